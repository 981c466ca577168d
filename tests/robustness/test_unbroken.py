"""Signals wait for work that they may not break into, and are heard behind it, once, by the handlers that they had."""

import signal
import threading

import pytest

from subzero.jit.unbroken import heed, unbroken


@pytest.fixture(autouse=True)
def handler():
    """Ctrl-C as in a session of Python."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield signal.default_int_handler
    signal.signal(signal.SIGINT, before)


def test_a_signal_is_heard_behind_the_work(handler):
    done = []

    def work():
        signal.raise_signal(signal.SIGINT)
        done.append("all")

    with pytest.raises(KeyboardInterrupt):
        unbroken(work)
    assert done == ["all"]
    assert signal.getsignal(signal.SIGINT) is handler
    assert unbroken(lambda: "the next") == "the next"


def test_work_that_heeds_ends_there_and_its_signal_is_heard_once(handler):
    def work():
        signal.raise_signal(signal.SIGINT)
        heed()
        raise AssertionError("it went on")

    with pytest.raises(KeyboardInterrupt):
        unbroken(work)
    heed()
    assert signal.getsignal(signal.SIGINT) is handler


def test_work_inside_work_ends_with_the_whole():
    done = []

    def inside():
        signal.raise_signal(signal.SIGINT)
        return "inner"

    with pytest.raises(KeyboardInterrupt):
        unbroken(lambda: done.append(unbroken(inside)))
    assert done == ["inner"]


def test_an_error_is_raised_as_it_is_and_signals_are_as_before(handler):
    with pytest.raises(ZeroDivisionError):
        unbroken(lambda: 1 / 0)
    assert signal.getsignal(signal.SIGINT) is handler


def test_every_handler_of_python_waits_and_no_other():
    heard = []
    before = signal.signal(signal.SIGUSR1, lambda number, _: heard.append(number))
    ignored = signal.signal(signal.SIGUSR2, signal.SIG_IGN)

    def work():
        signal.raise_signal(signal.SIGUSR1)
        signal.raise_signal(signal.SIGUSR2)
        return list(heard)

    try:
        assert unbroken(work) == []
        assert heard == [signal.SIGUSR1]
        assert signal.getsignal(signal.SIGUSR2) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGUSR1, before)
        signal.signal(signal.SIGUSR2, ignored)


def test_other_threads_work_as_they_are():
    seen = []
    thread = threading.Thread(target=lambda: seen.append(unbroken(lambda: signal.getsignal(signal.SIGINT))))
    thread.start()
    thread.join()
    assert seen == [signal.default_int_handler]
