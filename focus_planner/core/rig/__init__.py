"""The capture rig: cameras, their lenses and poses, depth of field and lens distortion."""
