"""What is computed of a frame's images, in torch: on a GPU, and where nothing can be compiled."""
