"""Tests: `unit` mirrors the package, `consistency` compares with exact cases and references, `house` tests the house itself."""
