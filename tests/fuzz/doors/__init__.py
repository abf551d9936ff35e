"""DOORS: every place where bytes come in from outside, by name. A new one is a line here."""

from tests.fuzz.door import Door
from tests.fuzz.doors import link, products, rover, stored, texts

DOORS: dict[str, Door] = {
    "scanner": rover.SCANNER,  # SCIP, to the flight program
    "can": rover.CAN,  # frames of any node
    "socketcand": rover.SOCKETCAND,  # text of a CAN server
    "datagrams": rover.DATAGRAMS,  # of anybody
    "orders": rover.ORDERS,  # of who holds a command key
    "barrier": rover.BARRIER,  # lock-step words of the bench
    "telemetry": link.TELEMETRY,  # of who holds the downlink key, to the station
    "forged": link.FORGED,  # of anybody, to the station
    "products": products.PRODUCTS,  # of the same
    "gateway": link.GATEWAY,  # MAVLink of another ground program
    "bridge": link.BRIDGE,  # CCSDS packets of another system
    "archive": stored.ARCHIVE,
    "record": stored.RECORD,
    "gdem": texts.GDEM,  # the orbiter's map
    "dem": texts.DEM,  # elevation files
    "config": texts.CONFIG,
    "scenario": texts.SCENARIO,
}
