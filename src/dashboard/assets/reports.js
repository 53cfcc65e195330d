// Reports of finished runs, each in a tab of its own.

import { loadListing, localTime } from "./listing.js";

export const loadReports = () =>
  loadListing("reports", "/api/reports", {
    entries: (answer) => answer.reports,
    describe: (report) => ({ ...report, note: ` ${report.name}, ${localTime(report.modified_s)}` }),
    none: ({ folder }) =>
      folder === null
        ? "The dashboard was started without --reports."
        : `${folder} has no reports yet: analyze, explain and plan write them with --out.`,
  });
