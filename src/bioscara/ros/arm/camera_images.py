"""Images of the world around a simulated arm."""

from __future__ import annotations

import threading
from typing import Any

from rclpy.qos import QoSProfile
from sensor_msgs.msg import CompressedImage

from bioscara.errors import BioscaraError, OwnerLostError
from bioscara.physics.camera import CameraView
from bioscara.ros import messages
from bioscara.ros.arm_time import ArmTime
from bioscara.ros.owner import OwnerConnection

IMAGES = "camera/image/compressed"
"""Name of the topic, as image_transport has it."""
_PERIOD = 0.25
"""Time between two images [s]."""
_REPEATED = 10.0
"""Time after which an error is reported again [s]."""


class CameraImages:
    """Publishes images while there are subscribers, in a thread of its own.

    Args:
        node: The node.
        time: Converts times of the arm.
        owner: Simulates the arm, and draws.
        view: Camera and size.
    """

    def __init__(self, node: Any, time: ArmTime, owner: OwnerConnection, view: CameraView) -> None:
        self._node, self._time, self._owner, self._view = node, time, owner, view
        self._publisher = node.create_publisher(CompressedImage, IMAGES, QoSProfile(depth=1))
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="bioscara-ros-images", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def close(self) -> None:
        """End; at the latest once the owner has answered."""
        self._ended.set()
        self._thread.join(1.0)

    def _run(self) -> None:
        while not self._ended.wait(_PERIOD):
            try:
                if self._publisher.get_subscription_count():
                    self._publish()
            except OwnerLostError:
                continue
            except BioscaraError as error:
                self._report(f"no image: {error}")
            except Exception as error:  # noqa: BLE001  of rclpy, where the node ends
                if not self._ended.is_set():
                    self._report(f"an image was not published: {error!r}")

    def _report(self, text: str) -> None:
        self._node.get_logger().error(text, throttle_duration_sec=_REPEATED)

    def _publish(self) -> None:
        file = self._owner.robot.simulation.image_file(*self._view)
        header = messages.header(self._time.ros(file.time), file.camera)
        self._publisher.publish(CompressedImage(header=header, format="png", data=file.data))
