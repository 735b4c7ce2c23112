# SPDX-License-Identifier: BSD-3-Clause
"""What programs and notebooks call: verbs as functions of names, paths or objects, and results that show themselves."""
