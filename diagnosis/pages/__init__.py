"""What all pages share: labels, axes, SVG, style."""
