"""What a bag holds: ``onemap bag info``."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from onemap_shared import keys
from onemap_shared.messages import AnsweredQuery, Detections, MapDigest, MapRevision
from onemap_tools.recording.bag_file import (
    CUT_OFF,
    DIGESTS,
    QUERIES,
    REVISIONS,
    BagReader,
    bag_files,
)


def info(path: Path) -> dict[str, Any]:
    """The bag as one JSON object, every chunk of it read and checked; raises BagError."""
    reader = BagReader(path)
    counts, sizes, asked = Counter[str](), Counter[str](), Counter[str]()
    schemas: dict[str, str] = {}
    encoders: dict[str, None] = {}
    detectors: dict[str, None] = {}
    answers: dict[str, AnsweredQuery] = {}  # the last to each text
    digest: MapDigest | None = None
    begins_ns = ends_ns = 0
    for message in reader.messages():
        topic, at_ns = message.topic, message.log_time_ns
        counts[topic] += 1
        sizes[topic] += len(message.data)
        schemas[topic] = message.schema
        begins_ns, ends_ns = min(begins_ns or at_ns, at_ns), max(ends_ns, at_ns)
        if topic == REVISIONS.key:
            encoders[message.decode(MapRevision).encoder_id] = None
        elif topic == keys.DETECTIONS.key:
            detectors[message.decode(Detections).detector_id] = None
        elif topic == QUERIES.key:
            query = message.decode(AnsweredQuery)
            asked[query.text] += 1
            answers[query.text] = query
        elif topic == DIGESTS.key:
            digest = message.decode(MapDigest)
    seconds = (ends_ns - begins_ns) / 1e9
    made = ("revision", "frames_fused", "sha256", "versions")
    return {
        "file": str(path),
        "bytes": sum(file.stat().st_size for file in bag_files(path)),
        "profile": reader.profile,
        "cut_off": reader.cut_off,
        "begins_ns": begins_ns,
        "seconds": round(seconds, 1),
        "topics": [
            {
                "topic": topic,
                "schema": schemas[topic],
                "messages": count,
                "bytes": sizes[topic],
                "rate_hz": round((count - 1) / seconds, 2) if seconds > 0 else 0.0,
            }
            for topic, count in sorted(counts.items())
        ],
        "encoders": [encoder_id for encoder_id in encoders if encoder_id],
        "detectors": list(detectors),
        "queries": [
            {
                "text": text,
                "times": asked[text],
                "verdict": last.verdict.value,
                "best_score": round(last.best_score, 3),
                "centre_m": [round(value, 3) for value in last.centre_m] or None,
            }
            for text, last in answers.items()
        ],
        "map": None if digest is None else {name: getattr(digest, name) for name in made},
        "metadata": dict(sorted(reader.metadata.items())),
    }


def describe(document: dict[str, Any]) -> list[str]:
    """The same for people, line by line."""
    lines = [f"{document['file']}: {document['bytes'] / 1e6:.1f} MB, {document['seconds']:.1f} s"]
    if document["cut_off"]:
        lines.append(CUT_OFF)
    lines += [
        f"  {each['topic']:<34} {each['messages']:>7} messages  {each['rate_hz']:>7.2f} Hz "
        f"{each['bytes'] / 1e6:>9.1f} MB  {each['schema']}"
        for each in document["topics"]
    ]
    for name in ("encoder", "detector"):
        if document[f"{name}s"]:
            lines.append(f"{name.capitalize()}: {', '.join(document[f'{name}s'])}")
    for query in document["queries"]:
        centre_m = query["centre_m"]
        at = f" at ({centre_m[0]:.2f}, {centre_m[1]:.2f}) m" if centre_m else ""
        lines.append(
            f"Asked {query['times']} times for {query['text']!r}, last answered "
            f"{query['verdict']} with the score {query['best_score']:.2f}{at}"
        )
    if (made := document["map"]) is not None:
        lines.append(
            f"Map: {made['frames_fused']} frames at revision {made['revision']}, "
            f"SHA-256 {made['sha256'][:16]}..., by {made['versions']}"
        )
    return lines
