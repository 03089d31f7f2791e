"""The window: what the person sees, and the keys that the person presses.

``process`` is what others use: a window in a process of its own. Inside that process, ``display`` finds the screen and
how large its pixels are (``edid``, ``calibration``), ``layout`` says where things lie in the picture, ``drawing`` and
``words`` draw it in ``colours``, and ``loop`` shows pictures and reads keys.

Only the window's own process imports pygame-ce (the extra ``experiment``).
"""
