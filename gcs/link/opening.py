"""A connection string becomes a connection."""

from gcs.link.connection import Notice, OpenConnection, Receiver
from gcs.link.serial_line import SerialLine
from gcs.link.streams import TcpClient, TcpServer
from gcs.link.udp import open_udp
from gcs.link.url import LinkUrl, Scheme


async def open_link(url: LinkUrl, receiver: Receiver, say: Notice) -> OpenConnection:
    """Open a connection in the running event loop; TCP clients and serial lines come and go by themselves.

    Args:
        url: what is to be opened.
        receiver: takes in what arrives.
        say: takes a sentence when the connection comes or goes.

    Raises:
        UsageError: an address cannot be bound.
    """
    match url.scheme:
        case Scheme.UDP_IN | Scheme.UDP_OUT:
            return await open_udp(url, receiver)
        case Scheme.TCP:
            return TcpClient(url, receiver, say)
        case Scheme.TCP_IN:
            server = TcpServer(url, receiver, say)
            await server.open()
            return server
        case Scheme.SERIAL:
            return SerialLine(url, receiver, say)
