"""The executor of the node: subscriptions in the thread that spins, all other callbacks in a pool.

A :class:`rclpy.executors.MultiThreadedExecutor` leaves a subscription out of the wait set while its
callback runs in the pool, and waits until a guard condition says that it has ended. With Fast DDS
that wake-up can be lost (ros2/rclcpp#3240): the messages of the next tenths of a second are then
received late or, beyond the depth of the queue, not at all. A callback that runs in the thread that
spins has ended before that thread waits again; it must not wait itself, as all others wait for it
(:class:`bioscara.ros.controllers.inbox.Inbox`).
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.executors import Executor, TimeoutException
from rclpy.subscription import Subscription


class NodeExecutor(Executor):  # type: ignore[misc]
    """Runs callbacks of subscriptions one after the other, and all others in parallel.

    Args:
        threads: Number of threads for the others, which may wait for the arm.
        context: Context of ROS.
        failed: Receives the exception of a callback.
    """

    def __init__(
        self, threads: int, context: Any, failed: Callable[[BaseException], object]
    ) -> None:
        super().__init__(context=context)
        self._pool = ThreadPoolExecutor(threads, "bioscara-ros")
        self._failed = failed

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for one callback, and run it or pass it to the pool.

        Args:
            timeout_sec: Longest time to wait [s]; None for no limit.
        """
        try:
            handler, entity, _ = self.wait_for_ready_callbacks(timeout_sec=timeout_sec)
        except (TimeoutException, InvalidHandle):
            # Of an entity that another thread has destroyed; the next call does not have it.
            return
        if isinstance(entity, Subscription):
            self._run(handler)
        else:
            self._pool.submit(self._run, handler)

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """End once all callbacks have ended; return true. It does not spin any more."""
        # First: at its end each callback wakes the executor, which that of rclpy does not wait for.
        self._pool.shutdown()
        return bool(super().shutdown(timeout_sec))

    def _run(self, handler: Any) -> None:
        handler()
        if handler.done() and (error := handler.exception()) is not None:
            self._failed(error)
