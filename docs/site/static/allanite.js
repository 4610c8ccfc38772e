// SPDX-License-Identifier: BSD-3-Clause
// What scrolls can be scrolled by the keyboard; the two side bars have names.
for (const block of document.querySelectorAll("div.highlight pre, .table-wrapper")) block.tabIndex = 0;
document.querySelector("aside.sidebar-drawer")?.setAttribute("aria-label", "Documents");
document.querySelector("aside.toc-drawer")?.setAttribute("aria-label", "On this page");
