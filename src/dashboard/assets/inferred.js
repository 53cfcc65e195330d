// Where a worm is by its motor's current alone, for one whose cells nobody sees.

/** The middle of the worm now by dead reckoning, m; null while no cycle was fitted. */
export function positionM({ inferred, state }) {
  if (typeof inferred?.position_m !== "number" || typeof inferred.advance_m !== "number") return null;
  const phase = state?.phase ?? inferred.phase;
  return inferred.position_m + (phase - inferred.phase) * inferred.advance_m;
}

/** Where its cells would be at rest, m, the foremost first; null while that is not known. */
export function cellPositionsM(worm, frame) {
  const middleM = positionM(frame);
  if (middleM === null) return null;
  return Array.from({ length: worm.cells }, (_, cell) => middleM + (0.5 * (worm.cells - 1) - cell) * worm.cell_spacing_m);
}
