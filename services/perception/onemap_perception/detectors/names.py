"""The names of COCO and what people call the same things."""

from __future__ import annotations

SYNONYMS = {
    "sofa": "couch",
    "settee": "couch",
    "television": "tv",
    "tv set": "tv",
    "telly": "tv",
    "tv monitor": "tv",
    "plant": "potted plant",
    "houseplant": "potted plant",
    "house plant": "potted plant",
    "fridge": "refrigerator",
    "phone": "cell phone",
    "mobile phone": "cell phone",
    "cellphone": "cell phone",
    "bike": "bicycle",
    "motorbike": "motorcycle",
    "plane": "airplane",
    "aeroplane": "airplane",
    "hairdryer": "hair drier",
    "hair dryer": "hair drier",
    "teddy": "teddy bear",
    "doughnut": "donut",
    "wineglass": "wine glass",
}
ARTICLES = ("a ", "an ", "the ")


def coco_name(name: str) -> str:
    """The name as COCO would write it: lower case, no article, its word for a synonym."""
    word = " ".join(name.lower().split())
    for article in ARTICLES:
        word = word.removeprefix(article)
    return SYNONYMS.get(word, word)
