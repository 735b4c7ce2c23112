# SPDX-License-Identifier: BSD-3-Clause
"""What kinds of physical effects there are: each kind says where its law enters the model."""
