"""The contact laws by the names that commands have for them."""

import microblock as mb

LAWS = {"microblock": mb.Microblock, "unilateral": mb.Unilateral, "microclamped": mb.Microclamped}
