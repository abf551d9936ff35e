"""Maps of the page: layers, products drawn on them, buffers of the 3D panel, previews."""
