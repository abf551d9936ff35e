"""Wire formats, tables and state machines over bytes. No I/O, clock or threads."""


class WireError(ValueError):
    """Error in one frame or message of the peer; the receiver counts it by kind and continues."""

    def __init__(self, kind: str, detail: str = "") -> None:
        super().__init__(f"{kind}: {detail}" if detail else kind)
        self.kind = kind
