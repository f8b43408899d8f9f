// What `vibrissa explore` bakes into the page: see src/explore/document.rs. Lengths in mm, angles in degrees, strain without unit.

import type { Signal, Skin } from "./beam";

export type Range = readonly [number, number];

/** Names of the charted functions; the far side is left out where it is the mirror image of the contact side, the signal where it is a strain. */
export type FunctionName = "contact" | "far" | "arc" | "force" | "signal";

export interface BakedAxis {
  readonly name: string;
  readonly variable: "linear" | "square" | "root" | "inverse" | "fourth";
  readonly range: Range;
}

/** Orders over all axes but the last, and coefficients of ascending order over the last. */
export type BakedRow = readonly [readonly number[], readonly number[]];

export interface BakedBranch {
  readonly T_over_P: number;
  readonly functions: Readonly<Partial<Record<FunctionName, readonly BakedRow[]>>>;
}

export interface Baked {
  readonly vibrissa_explore: number;
  readonly version: string;
  readonly name: string;
  readonly drive: "angle" | "displacement";
  readonly model: {
    readonly shear: boolean;
    readonly surface: boolean;
    readonly extension: boolean;
    readonly nu: number;
    readonly pole_radius: number;
    readonly E_MPa: number;
    /** Where the rod begins, in D, and its shear coefficient over that of a rigid clamp. */
    readonly clamp: { readonly c0: number; readonly k: number };
    /** Where sections distort. */
    readonly skin: Skin | null;
  };
  readonly sensor: { readonly signal: Signal };
  readonly gauge: { readonly side: "contact" | "far"; readonly strain_limit: number };
  readonly estimate: {
    readonly theory: string;
    readonly elongation: boolean;
    readonly K: number | null;
    readonly range: Range | null;
  };
  readonly domain: Readonly<Record<"D" | "d" | "L_a" | "x_ss" | "l" | "hub" | "a" | "drive", Range>>;
  readonly start: {
    readonly D: number;
    readonly d: number;
    readonly L_a: number;
    readonly x_ss: number;
    readonly l: number;
    readonly hub: number;
    readonly drive: number;
    readonly distances: number;
    readonly from: number;
    readonly to: number;
    readonly noise: number | null;
  };
  readonly gauss: readonly Range[];
  readonly power: number;
  readonly axes: readonly BakedAxis[];
  /** One, or where the contact has friction one for each of some T/P from −μ to μ. */
  readonly branches: readonly BakedBranch[];
  readonly census: {
    readonly taps: number;
    readonly outside: number;
    readonly strain: number;
    readonly deviation: number;
  };
  readonly kept: Readonly<Record<"gauge" | "sensor" | "tap" | "model" | "estimate", string>>;
}
