"""Signatures of policy bundles: ed25519 over the passport, which holds the hashes of everything else.

A robot that is given public keys runs no bundle that none of them has signed.
"""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import TYPE_CHECKING

from fulmar_core.config.bounded_file import KEY_BYTES, read_bounded
from fulmar_core.config.errors import BundleError, ConfigError
from fulmar_core.loop.policy_bundle import SIGNATURE, Bundle, read_bundle

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

DOMAIN = b"fulmar policy bundle 1\n"  # a signature for something else is none for a bundle


def make_keys(private: Path, public: Path) -> None:
    """Make a new pair of ed25519 keys, as PEM files.

    Raises:
        ConfigError: One of the files exists.
    """
    from cryptography.hazmat.primitives import serialization as s
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    for path in (private, public):
        if path.exists():
            raise ConfigError(f"{path}: exists already, and no key is overwritten. Name another file.")
    key = Ed25519PrivateKey.generate()
    private.touch(mode=0o600)
    private.write_bytes(
        key.private_bytes(s.Encoding.PEM, s.PrivateFormat.PKCS8, s.NoEncryption()),
    )
    public.write_bytes(key.public_key().public_bytes(s.Encoding.PEM, s.PublicFormat.SubjectPublicKeyInfo))


def sign_bundle(folder: Path, private: Path) -> None:
    """Sign a bundle whose hashes are right, with an ed25519 key in PEM; replaces an older signature.

    Raises:
        BundleError: The bundle is damaged.
        ConfigError: The key cannot be read.
    """
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
    from cryptography.hazmat.primitives.serialization import load_pem_private_key

    bundle = read_bundle(folder)
    try:
        key = load_pem_private_key(_read(private), password=None)
    except (ValueError, TypeError) as error:
        raise ConfigError(f"{private}: is no private key in PEM without a password.") from error
    if not isinstance(key, Ed25519PrivateKey):
        raise ConfigError(f"{private}: is no ed25519 key. Make one with `fulmar bundle keys`.")
    signature = key.sign(DOMAIN + bundle.passport_file)
    values = {"algorithm": "ed25519", "signature": base64.b64encode(signature).decode()}
    (folder / SIGNATURE).write_text(json.dumps(values) + "\n", encoding="utf-8")


def verify_bundle(bundle: Bundle, trusted: Path) -> str:
    """Reject a bundle that none of the trusted keys has signed.

    Args:
        bundle: From `read_bundle`.
        trusted: PEM file with one public key, or a folder of such files.

    Returns:
        Name of the file with the key that has signed it.

    Raises:
        BundleError: It is not signed, or by no trusted key, or was changed since.
        ConfigError: There is no readable key.
    """
    from cryptography.exceptions import InvalidSignature

    keys = _public_keys(trusted)
    signature = _signature(bundle.folder)
    message = DOMAIN + bundle.passport_file
    for name, key in keys.items():
        try:
            key.verify(signature, message)
        except InvalidSignature:
            continue
        return name
    raise BundleError(
        f"policy '{bundle.folder}' is signed by none of the {len(keys)} keys in {trusted}, "
        "or was changed after it was signed."
    )


def _signature(folder: Path) -> bytes:
    path = folder / SIGNATURE
    if not path.is_file():
        raise BundleError(
            f"policy '{folder}' is not signed, and this robot insists on it. "
            f"Sign it: fulmar bundle sign {folder} --key FILE"
        )
    try:
        values = json.loads(read_bounded(path, KEY_BYTES))
        return base64.b64decode(values["signature"], validate=True)
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise BundleError(f"{path}: cannot be read: {error}. Sign the bundle again.") from error


def _public_keys(trusted: Path) -> dict[str, Ed25519PublicKey]:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
    from cryptography.hazmat.primitives.serialization import load_pem_public_key

    paths = sorted(trusted.glob("*.pem")) if trusted.is_dir() else [trusted]
    if not paths:
        raise ConfigError(f"{trusted}: holds no .pem file with a public key.")
    keys = {}
    for path in paths:
        try:
            key = load_pem_public_key(_read(path))
        except ValueError as error:
            raise ConfigError(f"{path}: is no public key in PEM.") from error
        if not isinstance(key, Ed25519PublicKey):
            raise ConfigError(f"{path}: is no ed25519 public key.")
        keys[path.name] = key
    return keys


def _read(path: Path) -> bytes:
    try:
        return read_bounded(path, KEY_BYTES)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}).") from error
