"""Messages of one topic, as they come."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import Any, Generic, TypeVar

from ._instance import Instance, Presence
from ._topic import Message, Topic
from .errors import NotRunning, OtherVersion, Silent, WormError

M = TypeVar("M", bound=Message)

_PAUSE_S = 0.005
"""How often a topic without an event is looked at while nothing comes. A listener of the state's event would cost the loop a
system call each tick, and wake this process a thousand times a second."""
_WAIT_S = 0.1
"""How long one wait for an event lasts."""
_CHECK_S = 0.5
"""How often a silent topic makes this look whether the worm still runs."""
_GRACE_S = 3.0
"""How long a worm may be without a controller, as while it is started again."""


class Stream(Iterator[M], Generic[M]):
    """An iterator over the messages of one topic, in the order in which they were sent.

    It ends by an exception: `Silent` when nothing came for the stream's timeout, `NotRunning` when the worm has had no
    controller for three seconds. A worm that is started again within that time goes on in the same stream; numbers such as
    `State.sequence` then begin anew.

    A reader that is too slow loses the oldest messages and never slows the worm; `lost` counts them. Use a stream in the
    thread that made it. Leaving a ``with`` block, `close`, or the end of its worm closes it.
    """

    received: int
    """Messages that came so far."""

    def __init__(self, ports: Ports, topic: Topic[M], history: int, timeout: float | None) -> None:
        self._ports = ports
        self._topic = topic
        self._timeout = timeout
        self._subscriber, self._listener = ports.attach(topic, history)
        self._number: int | None = None
        self._lost = 0
        self.received = 0

    @property
    def lost(self) -> int | None:
        """Messages that were sent since the first one came, and did not come; None on topics that are not numbered."""
        return None if self._topic.number is None else self._lost

    def __iter__(self) -> Stream[M]:
        return self

    def __next__(self) -> M:
        return self.next(self._timeout)

    def next(self, timeout: float | None = None) -> M:
        """Return the next message; wait for it for `timeout` seconds, or as long as the worm runs.

        Raises:
            Silent: nothing came in time.
            NotRunning: the worm has had no controller for three seconds.
        """
        begun = time.monotonic()
        checked, missed = begun, None
        while (message := self._take()) is None:
            now = time.monotonic()
            if timeout is not None and now - begun >= timeout:
                self._ports.instance.require_running()
                raise Silent(f"{self._name()}: nothing came for {timeout:g} s")
            if now - checked >= _CHECK_S:
                checked = now
                is_there = self._ports.instance.holder("controller") is not None
                missed = None if is_there else missed or now
            if missed is not None and now - missed >= _GRACE_S:
                raise NotRunning(f"{self._ports.instance.worm} has ended: it has had no controller for {_GRACE_S:.0f} s")
            self._wait(_WAIT_S if timeout is None else min(_WAIT_S, begun + timeout - now))
        return message

    def take(self) -> list[M]:
        """Return all messages that are there, without waiting."""
        messages = []
        while (message := self._take()) is not None:
            messages.append(message)
        return messages

    def newest(self) -> M | None:
        """Return the newest message that is there, and pass over those before it; None when nothing new came. Does not wait."""
        newest = None
        while (sample := self._receive()) is not None:
            if newest is not None:
                newest.delete()
            newest = sample
        return None if newest is None else self._decoded(newest)

    def close(self) -> None:
        """Stop reading. What has not been read is lost."""
        for port in (self._subscriber, self._listener):
            if port is not None:
                port.delete()
        self._subscriber = self._listener = None

    def __enter__(self) -> Stream[M]:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _name(self) -> str:
        return f"worm/{self._ports.instance.worm}/{self._topic.name}"

    def _take(self) -> M | None:
        sample = self._receive()
        return None if sample is None else self._decoded(sample)

    def _receive(self) -> Any:
        """Return the next sample, counted; None when nothing is there."""
        if self._subscriber is None:
            raise WormError(f"{self._name()}: this stream is closed")
        try:
            sample = self._subscriber.receive()
        except self._ports.iceoryx.ReceiveError as error:
            raise WormError(f"{self._name()} cannot be read ({error}): open the worm again") from error
        if sample is not None:
            self.received += 1
            if self._topic.number is not None:
                number = int(getattr(sample.payload().contents, self._topic.number))
                if self._number is not None and number > self._number:
                    self._lost += number - self._number - 1
                self._number = number
        return sample

    def _decoded(self, sample: Any) -> M:
        message = self._topic.decode(sample.payload().contents)
        sample.delete()
        return message

    def _wait(self, seconds: float) -> None:
        if self._listener is None:
            time.sleep(max(0.0, min(seconds, _PAUSE_S)))
            return
        iceoryx = self._ports.iceoryx
        try:
            self._listener.timed_wait(iceoryx.Duration.from_micros(max(1, int(1e6 * seconds))))
        except iceoryx.ListenerWaitError:
            # A signal. Python's own handler of it runs now, and raises KeyboardInterrupt for Ctrl-C.
            return


class Ports:
    """The part of this process in the topics of a worm."""

    def __init__(self, instance: Instance) -> None:
        self.iceoryx: Any = _iceoryx()
        self.instance = instance
        instance.require_running()
        self._presence = Presence(instance)
        try:
            self._node = self._join()
        except BaseException:
            self._presence.close()
            raise

    def attach(self, topic: Topic[Any], history: int) -> tuple[Any, Any]:
        """Return a subscriber of a topic, and a listener of its event if it has one."""
        name = self.iceoryx.ServiceName.new(f"worm/{self.instance.worm}/{topic.name}")
        # The builders say what is missing or other than expected when they open, and how many there are when they create.
        service = self._opened(topic, lambda: self._service(name).publish_subscribe(topic.memory).open())
        builder = service.subscriber_builder().buffer_size(topic.buffer).history_request(history)
        subscriber = self._opened(topic, builder.create)
        listener = None
        if topic.has_event:
            event = self._opened(topic, lambda: self._service(name).event().open())
            listener = self._opened(topic, event.listener_builder().create)
        return subscriber, listener

    def close(self) -> None:
        """Leave the worm. The streams must be closed before."""
        self._node = None
        self._presence.close()

    def _service(self, name: Any) -> Any:
        return self._node.service_builder(name)

    def _join(self) -> Any:
        iceoryx = self.iceoryx
        config = iceoryx.config.default()
        config.global_cfg.root_path = iceoryx.Path.new(str(self.instance.folder))
        config.global_cfg.prefix = iceoryx.FileName.new(self.instance.prefix)
        # wormd cleans up after killed processes, under a time limit; here it could take long.
        config.global_cfg.node.cleanup_dead_nodes_on_creation = False
        config.global_cfg.node.cleanup_dead_nodes_on_destruction = False
        config.global_cfg.service.cleanup_dead_nodes_on_open = False
        builder = iceoryx.NodeBuilder.new().config(config)
        # Ctrl-C and SIGTERM stay Python's.
        builder = builder.signal_handling_mode(iceoryx.SignalHandlingMode.Disabled)
        return builder.create(iceoryx.ServiceType.Ipc)

    def _opened(self, topic: Topic[Any], opening: Callable[[], Any]) -> Any:
        iceoryx, worm = self.iceoryx, self.instance.worm
        try:
            return opening()
        except (iceoryx.PublishSubscribeOpenError, iceoryx.EventOpenError) as error:
            self.instance.require_running()
            raise OtherVersion(
                f"worm/{worm}/{topic.name} is not the topic that this package reads, {topic.memory.type_name()} "
                f"({error}): use the package of the version of wormd that runs the worm"
            ) from error
        except (iceoryx.SubscriberCreateError, iceoryx.ListenerCreateError) as error:
            raise WormError(
                f"worm/{worm}/{topic.name} cannot be read ({error}). A topic has 16 readers: end some, or use the relay (docs/relay.md)"
            ) from error


def _iceoryx() -> Any:
    try:
        import iceoryx2  # noqa: PLC0415, what only reads files does without it
    except ImportError as error:
        raise WormError("live topics need the package iceoryx2: pip install iceoryx2==0.10.0, on Linux") from error
    iceoryx2.set_log_level(iceoryx2.LogLevel.Error)
    return iceoryx2
