"""Figures of the wheel: time of the import, and of a prediction of ten million rows.

    python tests/speed.py [ROWS]

