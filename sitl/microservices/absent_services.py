"""What this vehicle does not have, said at once, so that a program that asks need not wait: files and logs."""

from sitl.dialect import Message, mavlink
from sitl.microservices.outbox import Outbox, Sender

_HEADER_BYTES, _PAYLOAD_BYTES = 12, 251
_OPCODE, _SIZE, _REQUESTED = 3, 4, 5
_NAK, _UNKNOWN_COMMAND = 129, 7
"""Of MAVLink FTP: the opcode of a refusal, and its reason."""


class AbsentServices:
    """Answers for services that are not there."""

    def __init__(self, outbox: Outbox) -> None:
        self._outbox = outbox

    def receive_file_request(self, message: Message, sender: Sender) -> None:
        """FILE_TRANSFER_PROTOCOL: no request is known."""
        request = bytes(message.payload[:_HEADER_BYTES])
        if request[_OPCODE] >= 128:  # an answer itself
            return
        refusal = bytearray(request)
        seq = (int.from_bytes(request[:2], "little") + 1) & 0xFFFF
        refusal[:2] = seq.to_bytes(2, "little")
        refusal[_OPCODE], refusal[_SIZE], refusal[_REQUESTED] = _NAK, 1, request[_OPCODE]
        refusal.append(_UNKNOWN_COMMAND)
        payload = list(refusal.ljust(_PAYLOAD_BYTES, b"\0"))
        answer = mavlink.MAVLink_file_transfer_protocol_message(0, sender.sysid, sender.compid, payload)
        self._outbox.send(sender.link, answer)

    def receive_log_request(self, message: Message, sender: Sender) -> None:
        """LOG_REQUEST_LIST: there are no logs, which takes one entry to say."""
        self._outbox.send(sender.link, mavlink.MAVLink_log_entry_message(0, 0, 0, 0, 0))
