"""Export of encoders as ONNX files."""
