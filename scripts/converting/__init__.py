"""Readers of other programs' files, for scripts/convert-*."""
