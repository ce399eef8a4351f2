"""The map in parts, each of which can be moved when SLAM corrects the pose."""
