"""Look at a run in a browser, while it goes on or later."""

from opspace.loop.requests import RunRequest as RunRequest
from opspace.view.viewer import Viewer as Viewer
