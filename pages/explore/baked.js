// What `vibrissa explore` bakes into the page: see src/explore/document.rs. Lengths in mm, angles in degrees, strain without unit.
export {};
