"""What people say around a thing that they ask for, and what they say that is refused.

"Could you please find the lamp?" asks for "the lamp". Of "the second chair" no part of a request
holds the second: it is refused, since an answer without it would be another question's.
"""

from __future__ import annotations

import re


def any_of(*phrases: str) -> str:
    """A pattern of phrases and the spaces after one: "(go) look/looking for" has an optional word
    and two forms of another."""
    return f"(?:{'|'.join(map(_phrase, sorted(phrases, key=len, reverse=True)))})"


def _phrase(text: str) -> str:
    words = (word.replace("'", "['’]?") for word in text.split())
    forms = (
        rf"(?:(?:{word[1:-1].replace('/', '|')})\b[\s,!]*)?"
        if word.startswith("(")
        else rf"(?:{word.replace('/', '|')})\b[\s,!]*"
        for word in words
    )
    return "".join(forms)


# What is said around any request.
COURTESY = any_of("kindly/just/maybe/so/now/uh/um/er/oh", "hey/hi/hello/ok/okay (robot)")
COURTESY = f"(?:{COURTESY}|(?:robot|well|sorry|excuse me)(?=,)[\\s,]*)*"
# What asks somebody to do it, what asks for a place, and what sends the robot there.
CAN_YOU = any_of(
    *("can/could/would/will you", "would you mind", "try to", "help me (to)", "let's"),
    *(
        "(go) (and) see if you can",
        "i need/want (you) to",
        "i'd like (you) to",
        "i would like (you) to",
    ),
)
WHERE = any_of(
    *("where's", "where is/are (there)", "(in) which/what room is", "where do you think is"),
    *("where can/could/do/did/would i/you/we find/see/get/have/keep/put/spot",),
    *("where i/you/we can/could find/see/get/spot",),
)
TELL = any_of(
    *("show/showing/tell/telling me", "find out", "check", "(have) (you) any idea", "i wonder"),
    "do/would/did you (happen) (to) know/see/remember",
)
DO = any_of(
    *("(go) (and) find/finding (me)", "(go) (and) look/looking for", "(go) (and) search (for)"),
    *(
        "get/give/bring/fetch (me)",
        "gimme",
        "track/tracking down",
        "hunt for/down",
        "check for",
        "point out",
    ),
    *("locate/locating/spot/seek/see/visit", "show me (to)", "(go) stand at/by"),
    *("go/drive/move/navigate/head/walk/run/get (yourself) (over) to", "bring yourself to"),
    *("take/bring/lead/guide/point me (over) to",),
)
HAVE = any_of(
    *("is/are there", "do/have we/you/i have/got/see/seen/own", "got", "what about", "what's"),
    *("have/did you/we see/seen/find/found/spot/spotted", "what happened to", "can you see/spot"),
    *("i'm looking for", "i am looking for", "i'm after", "i am after", "i'd like", "i would like"),
    *("how do/can i get to", "might/could/would/should there be", "can/could/may i have/get"),
    *("there should/must/might be", "do/have we/you/i still have", "i search"),
    *("need", "what's the location of", "have/did you/we come across", "can/could you detect"),
    *("we/i need/want/lost", "we/i can't find", "we/i cannot find"),
)
OPENING = re.compile(
    rf"{COURTESY}(?:(?:{TELL}|{CAN_YOU})?{COURTESY}(?:{TELL}?{WHERE}|{DO}|{HAVE}))?{COURTESY}", re.I
)
POLITE = re.compile(COURTESY, re.I)
# "show me where the lamp is", "where would the lamp be": the verb comes last.
INDIRECT = re.compile(
    rf"{COURTESY}(?:{CAN_YOU}|{DO})?{COURTESY}{TELL}?where\s+(?:(?:would|could|did|does)\s+)?"
    r"(?P<thing>.+?)\s+(?:is|are|be|might be|could be|is hiding|went|go|goes|end(?:ed)? up)"
    rf"(?:\s+and\s+{any_of('go/drive there', 'take me there')})?",
    re.I,
)
NAMES = "(?:my )?(?:dear|darling|honey|sweetheart|friend|buddy|robot|mate|sir|young (?:man|lady))"
YOU = "(?:can|could|will|would) you(?: check)?|if you(?: please)?|and tell me|for me|i guess"
HERE = r"(?:around )?here|(?:in|around) (?:the|this) (?:apartment|flat|house|home|place)"
WHEN = (
    "anywhere|somewhere|around|(?:real(?:ly)? )?quick(?:ly)?|right now|now|will do|too|as well|lol"
)
CLOSING = re.compile(rf"(?:,\s*{NAMES}|[\s,]+(?:{YOU}|(?:in )?{HERE}|{WHEN}))$", re.I)
PLEASE = re.compile(r"[\s,]*\b(?:(?:pretty\s+)*please|pls|plz|thank you|thanks)\b[\s,!]*", re.I)
# "I'm thirsty, find me something to drink": why it is asked for says nothing of it.
REASON = re.compile(
    r"(?:i['’]m|i am|we['’]re|we are|it['’]s) (?!looking|after)[^,.!?]*[,.!?]+\s*(?=\S)", re.I
)
# What a reason that may be left out does not say.
RESTRICTS = re.compile(
    r"n['’]t\b|\b(?:not|no|never|avoid|out|in|into|on|at|near|by|under|between|inside|outside|off|"
    r"except|without|dangerous|only|where|away)\b",
    re.I,
)
# "check the office for a printer" is "a printer in the office".
SEARCHED = re.compile(
    rf"{CAN_YOU}?{COURTESY}{any_of('(go) (and) search/check/scan', '(go) (and) look in/around')}"
    r"(?P<place>(?:the|this)\s+[\w ]+?)\s+for\s+(?P<thing>.+)",
    re.I,
)
THERE = re.compile(
    rf"{CAN_YOU}?{COURTESY}{any_of('go/drive/head/look to/in/into')}"
    rf"(?P<place>(?:the|this)\s+[\w ]+?)\s+and\s+{DO}(?P<thing>.+)",
    re.I,
)
WHOLE = re.compile(r"(?:the|this)\s+(?:whole\s+)?(?:apartment|flat|house|home|place)", re.I)
ANY = re.compile(r"(?:any|some)\s+(?=\S)", re.I)
THAT = re.compile(r"(?:that|this|those|these)\s+(?=\S)", re.I)
# No name of a thing holds one of these words: what they stand in was not understood.
NO_NAME = (
    "i|you|me|we|us|he|she|they|is|are|was|were|be|been|am|do|does|did|don't|could|would|should|"
    "have|has|had|if|what|who|when|why|how|there|where|let|go|get|find|yourself|happened|avoid|"
    "than|as|like|because|so|very|really|then|though|also|only|even|already|still|again|out|hiding|"
    "but|nowhere|never|hardly|not|no|isn't|aren't|minus|skip|ignore|it's|too|longer|either|away|"
    "preferably|ideally|perhaps|while|halfway|upstairs|downstairs"
)
# What begins a request for another deed than to find a thing or go to it.
DEEDS = "turn|stop|come|put|follow|wait|pick|carry|switch|check|look|search"
UNKNOWN_COLOURS = (
    "beige|turquoise|teal|magenta|cyan|maroon|lilac|navy|colou?rful|multicolou?red|"
    r"(?:redd|green|blu|yellow|brown|grey|black|whit|orang|purpl|pink)ish"
)

NUMBERS = "two|three|four|five|six|seven|eight|nine|ten|twelve|dozen"
ORDINALS = (
    "second|third|fourth|fifth|sixth|last|next|other|1st|2nd|3rd|[4-9]th|left|right|upper|lower"
)
SIZES = (
    "big|small|large|tall|short|long|tiny|huge|little|narrow|wide|heavy|bigger|smaller|larger|"
    "taller|biggest|smallest|largest|tallest|longest|nearest|closest|farthest|furthest|newest|"
    "oldest|best"
)
STATES = (
    "broken|dirty|clean|empty|full|open|closed|old|new|wet|lost|missing|free|favourite|favorite|"
    "comfortable|nice|beautiful|ugly|expensive|cheap|unmade|switched"
)
TIMES = (
    r"yesterday|today|tonight|tomorrow|earlier|ago|recently|before|just now|used to|"
    r"this (?:morning|evening|afternoon)|last (?:night|week|time|month)|"
    r"(?:i|we|you|he|she) (?:saw|left|put|had|used|bought|dropped|showed|found)"
)
COUNTS = "both|all|every|each|several|many|how many|a few|few|another"
# What is refused: the words, where they stand in the name of a thing, and what to do instead.
START = r"^(?:the |a |an )?"
NOT_MODELLED = tuple(
    (re.compile(words, re.I), hint)
    for words, hint in (
        (r"[()\[\]{}].*", "ask without brackets"),
        (r"\w+[.?!;:]+(?:\s.*|$)", "ask in one sentence"),
        (r"&|\+|\bplus\b", "ask for each by itself"),
        (
            r"#.*|\bnumber\s+(?=\d)",
            "things of one name are not counted: say what it is next to, or in which room",
        ),
        (r"\b(?:or|nor)\b", "of one or the other: ask for each by itself"),
        (
            rf"{START}(?:\d+|{NUMBERS}|{COUNTS})(?=\s)",
            "one thing is looked for, not how many there are: name it alone",
        ),
        (
            rf"{START}(?:first(?! aid)|{ORDINALS})(?=\s)",
            "things of one name are not counted: say what it is next to, or in which room",
        ),
        (
            r"\b(?:my|your|his|her|our|their|mine|yours|whose)\b|(?<!\bit)(?<!there)(?<!that)(?<!here)['’]s\s|s['’]\s",
            "whose a thing is, is not known: name it alone",
        ),
        (rf"\b(?:{TIMES})\b", "when a thing was there is not asked for: name it alone"),
        (
            rf"{START}(?:most |least |more |very )?(?:{SIZES})(?=\s)",
            "sizes and distances are not compared: say a colour, or what it is next to",
        ),
        (rf"{START}(?:{STATES})(?=\s|$)", "the state of a thing is not seen: name it alone"),
        (r"\b(?:more|less|\w+er)\b.*\bthan\b", "things are not compared: name one alone"),
        (
            r"\b(?:near|clos|furth|farth)est\b",
            "sizes and distances are not compared: say a colour, or what it is next to",
        ),
        (
            rf"\bfor (?:\d+|one|{NUMBERS})\b",
            "for how many a thing is, is not known: name it alone",
        ),
        (
            rf"{START}(?:{UNKNOWN_COLOURS})(?=\s)",
            "known colours are black, white, grey, red, orange, yellow, green, blue, purple, pink "
            "and brown",
        ),
        (
            rf"{START}(?:corner|middle|centre|center|end|edge|side|back|front|top|bottom) of\b",
            "a part of a thing or room is not asked for: name the whole",
        ),
        (
            r"^(?:some|any)(?:thing|where) .*",
            "say what it is for, as in 'something to sit on', or name it",
        ),
        (rf"^(?:{DEEDS})(?=$|\s)", "a robot finds a thing or goes to one: name the thing"),
        (rf"(?<![\w-])(?:{NO_NAME})(?![\w-])", "it belongs to no name of a thing"),
    )
)


def without_courtesy(text: str) -> str:
    """The text without what is said around any request: "a chair, please" is "a chair"."""
    bare = PLEASE.sub(" ", text).strip(" ,").rstrip(" .?!,;") or text
    reason = REASON.match(bare)
    if reason and not RESTRICTS.search(reason[0]):
        bare = bare[reason.end() :]
    start = POLITE.match(bare)
    bare = bare[start.end() :] if start and start.end() < len(bare) else bare
    while bare != (shorter := CLOSING.sub("", bare).rstrip(" .?!,;")):
        bare = shorter
    return bare


def asked_for(text: str) -> str:
    """What a question or command asks for: "where is the sofa?" is "the sofa".

    A name stays as it is, and so does a text of nothing else.
    """
    bare = without_courtesy(text)
    if indirect := INDIRECT.fullmatch(bare):
        return THAT.sub("", indirect["thing"], count=1)
    if searched := SEARCHED.fullmatch(bare) or THERE.fullmatch(bare):
        place, thing = searched["place"], searched["thing"]
        return thing if WHOLE.fullmatch(place) else f"{thing} in {place}"
    rest = bare[match.end() :] if (match := OPENING.match(bare)) else bare
    for word in (ANY, THAT):
        rest = word.sub("", rest, count=1) if word.match(rest) else rest
    return rest or bare


def check_modelled(phrase: str) -> None:
    """ValueError if the name of a thing says more than a request can ask for."""
    for words, hint in NOT_MODELLED:
        if found := words.search(phrase):
            raise ValueError(f"{found[0].strip()!r} is not understood: {hint}")
