# SPDX-License-Identifier: BSD-3-Clause
"""A page on this machine over recordings, runs and results: `allanite serve`.

The server opens no file of others and computes nothing: it looks up ids, maps series that are prepared, and asks child
processes, which run the commands of allanite themselves. So the page, the command line and Python give the same
numbers, and a file that crashes a parser costs one job.

============== ===========================================================================================
`server`       the socket, the address with its token
`connections`  how long a connection may take, how many there may be
`guard`        who may ask: Host, Origin, cookie, secret; the headers of every answer
`settings`     what is served, and all limits
`bounds`       reading and writing inside the served folder alone
`application`  the routes
`catalogue`    what lies in the folder, under ids (`sniffing`: by first bytes alone)
`pyramid`      series of any length; `store`: those that are prepared
`work`         from a request to a command and lines of Python (`kinds`, `options`)
`jobs`         the queue; `children`: the processes; `tasks`: what they do besides commands
`captures`     recorders, which outlive the page; `live`, `envelope`: runs while they grow; `events`: streams
`attached`     instruments that a request may choose, by id; `instruments_file`: those the administrator names
`documents`    figures and tables of results
`uploads`      dropped files
`static_files` the page itself
============== ===========================================================================================
"""

from allanite.plain_files.extras import require

require("starlette", "page", "the page")
require("uvicorn", "page", "the page")

from allanite.commands.page.server import serve  # noqa: E402 - nearly every module of the page imports them

__all__ = ["serve"]
