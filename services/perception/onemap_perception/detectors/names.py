"""The names of COCO and what people call the same things."""

from __future__ import annotations

from onemap_shared.names import normalised

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


def coco_name(name: str) -> str:
    """The name as COCO would write it: normalised, and COCO's word for a synonym."""
    word = normalised(name)
    return SYNONYMS.get(word, word)
