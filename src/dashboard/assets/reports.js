// Reports of finished runs, each in a tab of its own.

import { byId, fillRows, make, setText } from "./dom.js";

export async function loadReports() {
  const list = byId("reports");
  let text = "";
  let reports = [];
  try {
    const response = await fetch("/api/reports", { cache: "no-store" });
    const answer = await response.json();
    reports = answer.reports ?? [];
    if (answer.error) text = answer.error;
    else if (answer.folder === null) text = "The dashboard was started without --reports.";
    else if (reports.length === 0) text = `${answer.folder} has no reports yet: analyze, explain and plan write them with --out.`;
  } catch {
    text = "The server does not answer.";
  }
  fillRows(
    list,
    text ? [{ text }] : reports,
    () => make("li", "", make("a"), make("span", "note")),
    (row, report) => {
      const [link, note] = row.children;
      link.hidden = !report.url;
      if (report.url) {
        link.href = report.url;
        link.target = "_blank";
        link.rel = "noopener";
      }
      setText(link, report.title ?? "");
      setText(note, report.text ?? ` ${report.name}, ${new Date(report.modified_s * 1000).toLocaleString()}`);
    },
  );
}
