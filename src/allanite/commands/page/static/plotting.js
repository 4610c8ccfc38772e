// SPDX-License-Identifier: BSD-3-Clause
// How Plotly behaves on this page. One of its buttons shares a chart by sending the data to another host: never here.

export const CONFIG = {
  displaylogo: false,
  showTips: false,
  plotlyServerURL: "",
  modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d", "sendChartToCloud"],
};
