"""What the tests of the checker share."""

import pytest


@pytest.fixture
def precision(request):
    """The checker sets it in `recheck` and in its workers; tests of its parts need it as well."""
    import flint

    with flint.ctx.workprec(request.module.checker.balls.PRECISION):
        yield
