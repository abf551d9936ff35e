"""DOORS: every input from outside, by name. A new one is a line here."""

from tests.fuzz.door import Door
from tests.fuzz.doors import link, products, rover, stored, texts

DOORS: dict[str, Door] = {
    "scanner": rover.SCANNER,  # SCIP, to the flight program
    "can": rover.CAN,  # frames of any node
    "socketcand": rover.SOCKETCAND,  # text of a CAN server
    "datagrams": rover.DATAGRAMS,  # from any sender
    "orders": rover.ORDERS,  # from a holder of a command key
    "barrier": rover.BARRIER,  # lock-step messages of the bench
    "telemetry": link.TELEMETRY,  # from a holder of the downlink key, to the station
    "forged": link.FORGED,  # from any sender, to the station
    "products": products.PRODUCTS,  # from a holder of the downlink key
    "gateway": link.GATEWAY,  # MAVLink of another ground program
    "bridge": link.BRIDGE,  # CCSDS packets of another system
    "archive": stored.ARCHIVE,
    "record": stored.RECORD,
    "gdem": texts.GDEM,  # the orbiter's map
    "dem": texts.DEM,  # elevation files
    "config": texts.CONFIG,
    "scenario": texts.SCENARIO,
}
