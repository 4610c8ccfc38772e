# SPDX-License-Identifier: BSD-3-Clause
"""What people see of a result.

``wording``   words and digits, each said once
``terminal``  tables and findings as text
``report``    one self-contained page of HTML
``figures``   `plot`, on paper and on screen alike
"""
