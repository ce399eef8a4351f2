"""Training data: rendered frames, augmentation, batches and class texts."""
