# SPDX-License-Identifier: BSD-3-Clause
"""What several verbs share: arguments, recordings by name, results into all the files that were asked for."""
