"""Problems as HTTP responses."""

from __future__ import annotations

import json

from starlette.responses import Response

from onemap_gateway.http.problems import MEDIA_TYPE, HttpProblem


def problem_response(problem: HttpProblem) -> Response:
    """The response that tells the client."""
    # ASCII only: the document may quote text that is not valid Unicode
    body = json.dumps(problem.document).encode("ascii")
    return Response(body, problem.status, problem.headers, MEDIA_TYPE)
