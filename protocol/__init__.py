"""What crosses a wire: formats, tables, state machines over bytes. No I/O, clock, threads."""


class WireError(ValueError):
    """One frame or message of the other side is bad; the receiver counts it by kind and goes on."""

    def __init__(self, kind: str, detail: str = "") -> None:
        super().__init__(f"{kind}: {detail}" if detail else kind)
        self.kind = kind
