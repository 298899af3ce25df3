"""A certificate that a gateway makes for itself."""

from __future__ import annotations

import datetime
import ipaddress
import os
import secrets
from collections.abc import Sequence
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from bioscara.errors import ConfigurationError
from bioscara.files.regular_file import RegularFile
from bioscara.web.access.tokens import read_private

_YEAR = datetime.timedelta(days=365)
_LEFT = datetime.timedelta(days=7)
"""Validity below which a certificate is made anew."""
_LONGEST = 1 << 16
"""Longest file [byte]."""


def fingerprint(path: Path) -> str:
    """Return the SHA-256 fingerprint of a certificate, as browsers show it.

    Raises:
        ConfigurationError: The file has no certificate, or cannot be read.
    """
    digest = _certificate(path).fingerprint(hashes.SHA256())
    return digest.hex(":").upper()


def self_signed(certificate: Path, key: Path, names: Sequence[str]) -> None:
    """Make a certificate with its key, unless files that were made before can be used.

    Args:
        certificate: File of the certificate.
        key: File of the key; of mode 0600.
        names: Names and addresses that it is for.

    Raises:
        AccessError: Others can read the key.
        ConfigurationError: A file cannot be read or written.
    """
    try:
        if not _usable(certificate, key, names):
            _make(certificate, key, names)
    except OSError as error:
        name = error.filename2 or error.filename or key
        raise ConfigurationError(f"{name}: {error.strerror}; remove that") from error


def _usable(certificate: Path, key: Path, names: Sequence[str]) -> bool:
    if not (certificate.exists() and key.exists()):
        return False
    try:
        private = serialization.load_pem_private_key(read_private(key, _LONGEST), None)
        found = _certificate(RegularFile(certificate))
        extension = found.extensions.get_extension_for_class(x509.SubjectAlternativeName)
    except (ValueError, TypeError, x509.ExtensionNotFound):
        return False
    left = found.not_valid_after_utc - datetime.datetime.now(datetime.UTC)
    return (
        private.public_key() == found.public_key()
        and left > _LEFT
        and list(extension.value) == _alternatives(names)
    )


def _make(certificate: Path, key: Path, names: Sequence[str]) -> None:
    private = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "bioscara web")])
    now = datetime.datetime.now(datetime.UTC)
    made = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(private.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(hours=1))
        .not_valid_after(now + _YEAR)
        .add_extension(x509.SubjectAlternativeName(_alternatives(names)), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .sign(private, hashes.SHA256())
    )
    secret = private.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    _write(key, secret, 0o600)
    _write(certificate, made.public_bytes(serialization.Encoding.PEM), 0o644)


def _alternatives(names: Sequence[str]) -> list[x509.GeneralName]:
    found: list[x509.GeneralName] = []
    for name in names:
        try:
            found.append(x509.IPAddress(ipaddress.ip_address(name)))
        except ValueError:
            found.append(x509.DNSName(name))
    return found


def _certificate(path: Path) -> x509.Certificate:
    try:
        with path.open("rb") as file:
            return x509.load_pem_x509_certificate(file.read(_LONGEST))
    except OSError as error:
        raise ConfigurationError(f"{path}: {error.strerror}; remove that") from error
    except ValueError as error:
        raise ConfigurationError(f"{path} has no certificate as PEM: {error}") from error


def _write(path: Path, content: bytes, mode: int) -> None:
    """Write a file as a whole, under another name first; it never has another mode."""
    other = path.with_name(f"{path.name}.{secrets.token_hex(4)}")
    file = os.open(other, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, mode)
    try:
        with os.fdopen(file, "wb") as stream:
            stream.write(content)
        other.replace(path)
    except BaseException:
        other.unlink(missing_ok=True)
        raise
