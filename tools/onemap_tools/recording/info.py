"""What a bag holds: ``onemap bag info``."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from onemap_shared import keys
from onemap_shared.messages import AnsweredQuery, Detections, MapDigest, MapRevision
from onemap_tools.recording.bag_file import DIGESTS, QUERIES, REVISIONS, BagMessage, BagReader


@dataclass(slots=True)
class BagSummary:
    """Counts of a bag's messages by topic, their bytes, and what the map was."""

    counts: Counter[str] = field(default_factory=Counter)
    sizes: Counter[str] = field(default_factory=Counter)
    schemas: dict[str, str] = field(default_factory=dict)
    begins_ns: int = 0
    ends_ns: int = 0
    encoders: dict[str, None] = field(default_factory=dict)
    detectors: dict[str, None] = field(default_factory=dict)
    digest: MapDigest | None = None
    asked: Counter[str] = field(default_factory=Counter)
    answers: dict[str, AnsweredQuery] = field(default_factory=dict)  # the last to each text

    def add(self, message: BagMessage) -> None:
        """Count a message."""
        self.counts[message.topic] += 1
        self.sizes[message.topic] += len(message.data)
        self.schemas[message.topic] = message.schema
        self.begins_ns = min(self.begins_ns or message.log_time_ns, message.log_time_ns)
        self.ends_ns = max(self.ends_ns, message.log_time_ns)
        if message.topic == REVISIONS.key:
            encoder_id = message.decode(MapRevision).encoder_id
            self.encoders |= {encoder_id: None} if encoder_id else {}
        elif message.topic == keys.DETECTIONS.key:
            self.detectors |= {message.decode(Detections).detector_id: None}
        elif message.topic == QUERIES.key:
            query = message.decode(AnsweredQuery)
            self.asked[query.text] += 1
            self.answers[query.text] = query
        elif message.topic == DIGESTS.key:
            self.digest = message.decode(MapDigest)


def info(path: Path) -> dict[str, Any]:
    """The bag as one JSON object, every chunk of it read and checked; raises BagError."""
    reader, found = BagReader(path), BagSummary()
    for message in reader.messages():
        found.add(message)
    seconds = (found.ends_ns - found.begins_ns) / 1e9
    digest = found.digest
    return {
        "file": str(path),
        "bytes": path.stat().st_size,
        "profile": reader.profile,
        "cut_off": reader.cut_off,
        "begins_ns": found.begins_ns,
        "seconds": round(seconds, 1),
        "topics": [
            {
                "topic": topic,
                "schema": found.schemas[topic],
                "messages": count,
                "bytes": found.sizes[topic],
                "rate_hz": round((count - 1) / seconds, 2) if seconds > 0 else 0.0,
            }
            for topic, count in sorted(found.counts.items())
        ],
        "encoders": list(found.encoders),
        "detectors": list(found.detectors),
        "queries": [_query(found.asked[text], last) for text, last in found.answers.items()],
        "map": None
        if digest is None
        else {
            "revision": digest.revision,
            "frames_fused": digest.frames_fused,
            "sha256": digest.sha256,
            "versions": digest.versions,
        },
        "metadata": {name: reader.metadata[name] for name in sorted(reader.metadata)},
    }


def _query(times: int, last: AnsweredQuery) -> dict[str, Any]:
    return {
        "text": last.text,
        "times": times,
        "verdict": last.verdict.value,
        "best_score": round(last.best_score, 3),
        "centre_m": [round(value, 3) for value in last.centre_m] or None,
    }


def describe(document: dict[str, Any]) -> list[str]:
    """The same for people, line by line."""
    lines = [f"{document['file']}: {document['bytes'] / 1e6:.1f} MB, {document['seconds']:.1f} s"]
    if document["cut_off"]:
        lines.append("It was cut off: the recorder was killed, or the disk was full.")
    lines += [
        f"  {each['topic']:<34} {each['messages']:>7} messages  {each['rate_hz']:>7.2f} Hz "
        f"{each['bytes'] / 1e6:>9.1f} MB  {each['schema']}"
        for each in document["topics"]
    ]
    if document["encoders"]:
        lines.append(f"Encoder: {', '.join(document['encoders'])}")
    if document["detectors"]:
        lines.append(f"Detector: {', '.join(document['detectors'])}")
    lines += [
        f"Asked {query['times']} times for {query['text']!r}, last answered {query['verdict']} "
        f"with the score {query['best_score']:.2f}{_at(query['centre_m'])}"
        for query in document["queries"]
    ]
    if (made := document["map"]) is not None:
        lines.append(
            f"Map: {made['frames_fused']} frames at revision {made['revision']}, "
            f"SHA-256 {made['sha256'][:16]}..., by {made['versions']}"
        )
    return lines


def _at(centre_m: list[float] | None) -> str:
    return f" at ({centre_m[0]:.2f}, {centre_m[1]:.2f}) m" if centre_m else ""
