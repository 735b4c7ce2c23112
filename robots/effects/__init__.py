# SPDX-License-Identifier: BSD-3-Clause
"""The catalogue of physical effects, one file each; a file is found by being here."""
