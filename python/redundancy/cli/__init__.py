"""The command line, and the job files that it reads."""

from .commands import main
from .job import Job, read_job

__all__ = ["Job", "main", "read_job"]
