"""Sessions of onnxruntime. No other module imports it.

From 1.29 on its Linux builds send usage events to their maker unless the environment variable is
set before the library is loaded.
"""
# Talks: tells onnxruntime through the environment to be quiet.

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

os.environ["ORT_DISABLE_TELEMETRY"] = "1"

import onnxruntime


def open_session(path: Path, *, threads: int) -> Any:
    """An inference session on the CPU. Raises ValueError with onnxruntime's reason.

    Waiting threads sleep instead of spinning: the same cores also run the mapper.
    """
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    try:
        return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    except Exception as problem:  # onnxruntime's errors share no other base class
        raise ValueError(str(problem).splitlines()[0]) from problem
