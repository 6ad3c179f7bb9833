"""Keys, key times and certificates on disk: the only place that reads and writes them.

This package owns the key file of a robot, the state that must survive a restart, and the
certificates of a team. It decides nothing about PDUs: `sealing` does.
"""

from sdrlinkd.keyring.certificates import make_certificates, new_authority, zenoh_file
from sdrlinkd.keyring.files import (
    CREDENTIAL,
    KeyFile,
    StoredKey,
    check_number,
    create_key_file,
    key_file_text,
    load_keys,
    parse_key_file,
    read_key_file,
    write_key_file,
)
from sdrlinkd.keyring.making import new_key
from sdrlinkd.keyring.state import KeyState, machine_tag, service_name, state_dir

__all__ = [
    "CREDENTIAL",
    "KeyFile",
    "KeyState",
    "StoredKey",
    "check_number",
    "create_key_file",
    "key_file_text",
    "load_keys",
    "machine_tag",
    "make_certificates",
    "new_authority",
    "new_key",
    "parse_key_file",
    "read_key_file",
    "service_name",
    "state_dir",
    "write_key_file",
    "zenoh_file",
]
