"""What vehicles keep from one simulation to the next, in one folder: parameters, and signing."""

from collections.abc import Mapping
from pathlib import Path

from sitl.autopilot.memory import Memory, SigningMemory
from sitl.autopilot.parameter_table import Parameter
from sitl.link.parameter_files import ParameterFiles
from sitl.link.signing_files import SigningFiles


class MemoryFiles:
    """The files of a fleet.

    Args:
        folder: where they are; made if it is not there.
        table: what parameters there are.
    """

    def __init__(self, folder: Path, table: tuple[Parameter, ...]) -> None:
        self._parameters = ParameterFiles(folder, table)
        self._signing = SigningFiles(folder)

    def load(self, sysid: int, keys: Mapping[int, bytes]) -> Memory:
        """What a vehicle has stored; a key that is given beats a stored one, and makes what was signed with it void.

        Raises:
            SitlError: a file is none of ours.
            OSError: it cannot be read.
        """
        signing = self._signing.load(sysid)
        key = keys.get(sysid, signing.key)
        if key != signing.key:
            signing = SigningMemory(key, signing.timestamp)
        return Memory(parameters=self._parameters.load(sysid), signing=signing)

    def save(self, memories: dict[int, Memory]) -> None:
        """Write what has changed."""
        self._parameters.save(memories)
        self._signing.save(memories)
