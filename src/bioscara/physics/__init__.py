"""Bodies around the arm, by MuJoCo: the extra ``physics``, for images ``physics-view``."""
