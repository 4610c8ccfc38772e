# SPDX-License-Identifier: BSD-3-Clause
"""What people see of a result.

``registry``  which view shows which result: one module each (`variation`, `earth_rate`), the others in ``report``
``blocks``    what a page consists of; `pieces`, `result_page` and `rates` are what several pages share
``wording``   words and digits, each said once
``terminal``  tables and findings as text
``report``    one self-contained page of HTML; `plain_page`, the same for the page of ``serve``
``figures``   `plot`, on paper and on screen alike
"""
