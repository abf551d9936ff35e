"""SCIP 2.0, the protocol of Hokuyo scanners, both directions: bytes in, checked replies out, and back. No I/O.

A request is one line; a reply is lines that end in one LF each and closes with an empty line, so frames end at LF LF:

    request   MD 0000 1080 01 0 00 LF            code, first, last step, cluster, skip, number of scans (00 endless)

    reply     MD0000108001000 LF                 echo of the request (no sum)
              00P LF                             status (2), its sum
              LF                                 end: the stream is on
    scan      MD0000108001000 LF                 echo; its last two digits count the scans that remain
              99b LF                             status of a scan
              0KO[g LF                           stamp: 4 characters, 24 bits of milliseconds; its sum
              <64 characters>s LF                data in blocks of 64 characters, each with its sum; values straddle
              ...                                the borders of blocks, a range has 3 characters
              <1 to 64 characters>s LF
              LF                                 end

    value     6 bits a character, high bits first, each plus 0x30: characters 0x30 to 0x6F
    sum       the low 6 bits of the sum of the line's bytes, plus 0x30; it may be `;`
    text      KEY:VALUE;s                        the sum covers what stands before the `;`

Source: Hokuyo C-42-03320B; statuses and strings as logged from a UTM-30LX. Nothing here was tried on a physical sensor.
One idea per file, both directions together: writer and reader of a format can be compared at a glance.
"""

from protocol.scip.block_reader import BlockReader, Reader
from protocol.scip.blocks import BLOCK, decode_blocks, encode_blocks
from protocol.scip.characters import checksum, decode_value, encode_value
from protocol.scip.decoder import ScanDecoder
from protocol.scip.echoes import MISSING, decode_echoes, encode_echoes
from protocol.scip.replies import (
    STAMP_MODULUS,
    Reply,
    ScanReply,
    parse_reply,
    parse_scan,
    parse_stamp,
    parse_state,
    parse_text,
    reply,
    scan_reply,
    stamp_line,
    state_line,
    text_line,
)
from protocol.scip.requests import (
    MEASURING,
    PARAMETERS,
    Measuring,
    Request,
    ScanRequest,
    parse_request,
    parse_scan_request,
    refusal,
    request,
)
from protocol.scip.splitter import FRAME_LIMIT, Splitter
from protocol.scip.statuses import meaning, state_text, succeeded
from protocol.scip.value_codes import Code, codes_of

__all__ = [
    "BLOCK",
    "FRAME_LIMIT",
    "MEASURING",
    "MISSING",
    "PARAMETERS",
    "STAMP_MODULUS",
    "BlockReader",
    "Code",
    "Measuring",
    "Reader",
    "Reply",
    "Request",
    "ScanDecoder",
    "ScanReply",
    "ScanRequest",
    "Splitter",
    "checksum",
    "codes_of",
    "decode_blocks",
    "decode_echoes",
    "decode_value",
    "encode_blocks",
    "encode_echoes",
    "encode_value",
    "meaning",
    "parse_reply",
    "parse_request",
    "parse_scan",
    "parse_scan_request",
    "parse_stamp",
    "parse_state",
    "parse_text",
    "refusal",
    "reply",
    "request",
    "scan_reply",
    "stamp_line",
    "state_line",
    "state_text",
    "succeeded",
    "text_line",
]
