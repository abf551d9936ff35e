"""The ground that is driven on: how it is made, kept and named."""
