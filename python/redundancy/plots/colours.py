"""The colours of every picture and page, which colour-blind readers can tell apart."""

from typing import Final

# Okabe and Ito's palette.
BLUE: Final = "#0072B2"
ORANGE: Final = "#D55E00"
GREEN: Final = "#009E73"
PURPLE: Final = "#CC79A7"
SKY: Final = "#56B4E9"
GREY: Final = "#8C8C8C"
BLACK: Final = "#000000"

WHITE: Final = "#FFFFFF"
PALE: Final = "#D9D9D9"

LINE_COLORS: Final = (WHITE, ORANGE, SKY)
"""Lines over a map, one after the other."""
