"""Every status code explains itself."""

import numpy as np
import pytest

from umat import status

NAMES = [name for name in vars(status) if name.isupper() and name not in ("CODES",)]


def test_every_code_has_one_name_and_fits_in_int8():
    codes = [getattr(status, name) for name in NAMES if not name.startswith("_")]
    assert sorted(codes) == sorted(status.CODES) == list(range(len(codes)))
    assert np.array(codes, dtype=np.int8).tolist() == codes


@pytest.mark.parametrize("code", status.CODES)
def test_message_is_a_sentence(code):
    sentence = status.message(np.int8(code))
    assert sentence[0].isupper()
    assert sentence.endswith(".")


def test_zero_means_done():
    assert status.OK == 0
