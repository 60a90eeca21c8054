"""The MAVLink dialect, with the extension fields that PyPI's pymavlink lacks; used as a codec only."""

from typing import Any

from pymavlink.dialects.v20 import development as mavlink

from missions.mavlink_extensions import add_extension_fields

add_extension_fields(mavlink)

Message = Any
"""A pymavlink message object; its classes are generated without types."""

__all__ = ["Message", "mavlink"]
