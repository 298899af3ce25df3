"""Names and addresses that a gateway answers to."""

from __future__ import annotations

import pytest

from bioscara.errors import ConfigurationError
from bioscara.web.access.addresses import OwnAddresses, is_any, is_loopback, require_host_name


def test_hosts_have_the_port_unless_it_is_the_usual_one() -> None:
    own = OwnAddresses(["localhost", "::1"], 8080, tls=False)
    assert own.hosts == {"localhost:8080", "[::1]:8080"}
    assert own.origins == {"http://localhost:8080", "http://[::1]:8080"}
    usual = OwnAddresses(["arm.example"], 443, tls=True)
    assert usual.hosts == {"arm.example", "arm.example:443"}
    assert usual.is_origin(["https://ARM.example"])
    assert not usual.is_origin(["http://arm.example"])


@pytest.mark.parametrize(
    "hosts",
    [
        [],
        ["localhost:8080", "localhost:8080"],
        [""],
        ["localhost"],
        ["localhost:80800"],
        ["localhost:8080.evil.example"],
        ["evil.example:8080"],
        ["localhost.:8080"],
        ["user@localhost:8080"],
        ["localhost:8080/"],
    ],
)
def test_other_hosts_are_not_own(hosts: list[str]) -> None:
    own = OwnAddresses(["localhost"], 8080, tls=False)
    assert not own.is_host(hosts)
    assert own.is_host(["LocalHost:8080"])
    assert not own.is_origin([f"http://{host}" for host in hosts])


def test_names_are_normal() -> None:
    assert require_host_name("ARM.Example") == "arm.example"
    assert require_host_name("[0:0::1]") == "::1"
    assert require_host_name("10.0.0.7") == "10.0.0.7"
    for wrong in ("", "a b", "arm.example:80", "http://arm", "a\nb", "x" * 300, "-a", "*"):
        with pytest.raises(ConfigurationError, match="is no name of a computer"):
            require_host_name(wrong)


def test_loopback_is_what_no_other_computer_reaches() -> None:
    assert all(map(is_loopback, ("127.0.0.1", "127.1.2.3", "localhost", "::1")))
    assert not any(map(is_loopback, ("0.0.0.0", "::", "10.1.2.3", "fe80::1")))
    assert [is_any(host) for host in ("0.0.0.0", "::", "127.0.0.1", "arm")] == [1, 1, 0, 0]
    with pytest.raises(ConfigurationError, match="has no address"):
        is_loopback("absent.invalid")
