"""ONNX Runtime as policies use it: one thread, and memory within bounds."""

from __future__ import annotations

import functools

import onnxruntime

# A policy of fifty megabytes takes a few of them more; a network of bytes can ask for terabytes by one constant.
MOST_MEMORY = 400_000_000  # [bytes]


def open_network(model: bytes) -> onnxruntime.InferenceSession:
    """Load a model for inference in one thread.

    Args:
        model: The model as a file holds it.

    Raises:
        Exception: ONNX Runtime refuses it, with an exception of its own; running it may raise the same where it needs
            more than `MOST_MEMORY`.
    """
    _limit_memory()
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    options.add_session_config_entry("session.use_env_allocators", "1")
    return onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])


@functools.cache
def _limit_memory() -> None:
    """Make the allocator that all sessions of this process share."""
    kind = onnxruntime.OrtAllocatorType.ORT_ARENA_ALLOCATOR
    place = onnxruntime.OrtMemoryInfo("Cpu", kind, 0, onnxruntime.OrtMemType.DEFAULT)
    onnxruntime.create_and_register_allocator(place, onnxruntime.OrtArenaCfg({"max_mem": MOST_MEMORY}))
