"""ONNX Runtime and OpenVINO on the exported backbone. torch is not loaded here, so that memory is the runtime's own."""

import numpy as np

import scene
from protocol import Work

MEAN = np.array([0.485, 0.456, 0.406], dtype=np.float32)
STD = np.array([0.229, 0.224, 0.225], dtype=np.float32)


def backbone_input():
    pixels = scene.picture().astype(np.float32) / 255
    return np.ascontiguousarray(((pixels - MEAN) / STD).transpose(2, 0, 1)[None], dtype=np.float32)


def level_facts(levels):
    return {f"p{level + 2}": float(np.abs(values).mean()) for level, values in enumerate(levels)}


def onnxruntime_backbone(onnx, threads):
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_ENABLE_ALL
    session = onnxruntime.InferenceSession(onnx, options, providers=["CPUExecutionProvider"])
    inputs = {session.get_inputs()[0].name: backbone_input()}
    levels = session.run(None, inputs)
    version = f"onnxruntime {onnxruntime.__version__}"
    return Work(lambda: session.run(None, inputs), level_facts(levels), None, version)


def openvino_backbone(onnx, threads):
    import openvino

    # Single precision, like the other runtimes: OpenVINO would use bfloat16 if the processor has it.
    config = {
        "INFERENCE_NUM_THREADS": threads,
        "PERFORMANCE_HINT": "LATENCY",
        "INFERENCE_PRECISION_HINT": "f32",
    }
    core = openvino.Core()
    request = core.compile_model(core.read_model(onnx), "CPU", config).create_infer_request()
    x = backbone_input()
    levels = [tensor.copy() for tensor in request.infer([x]).values()]
    version = f"openvino {openvino.__version__.split('-')[0]}"
    # The outputs are shared, not copied, which takes the least time.
    return Work(lambda: request.infer([x], share_inputs=True, share_outputs=True), level_facts(levels), None, version)
