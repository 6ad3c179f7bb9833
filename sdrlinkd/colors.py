"""Colors for all eyes, by Okabe and Ito; in this order, neighbors differ in lightness, too."""

COLORS = (
    "#000000", "#E69F00", "#0072B2", "#56B4E9", "#D55E00", "#009E73", "#CC79A7", "#999999",
)  # fmt: skip
