//! What the simulated robot takes from the simulator, and a real one would have to measure.

/// One thing that is told.
pub(super) struct Told {
    /// The quantity that the simulator hands over.
    pub what: &'static str,
    /// Where it comes from.
    pub source: &'static str,
    /// The error under which grasps are tried, if any.
    pub error: &'static str,
}

/// All of it, in the order in which an attempt uses it.
pub(super) fn told_from_truth() -> [Told; 13] {
    let told = |what, source, error| Told { what, source, error };
    [
        told(
            "box, outline, grasp marks of the demonstration",
            "projected and drawn from the part's own geometry, vertices as a careful person clicks them",
            "jittered by 3 px",
        ),
        told("the part's rotational symmetry, at teaching", "its description (object.json)", "none"),
        told("camera intrinsics: focal length, middle, no distortion", "the simulated camera itself", "none"),
        told(
            "height of the camera in the demonstration, 0.58 m",
            "the demonstration was photographed from there, and both looks are from there",
            "none in grasps; the axis of heights in pictures",
        ),
        told("pose of the arm at each picture", "the simulated joints, without encoder errors", "none"),
        told("camera in the hand (hand-eye)", "the model of the arm", "2 mm and 0.5°"),
        told("height of the table", "the simulated table, flat and level at z = 0", "none"),
        told("height of the marks over the table", "the part's description (object.json)", "3 mm"),
        told("height of the grasp over the table", "the part's description (object.json)", "none"),
        told("the area where parts lie", "scenes place the part where the look-out pose shows it whole", "none"),
        told("that the part rests on the face it was shown on", "scenes place it so", "none"),
        told("dynamics of the arm for its controller", "the simulated arm's own mass matrix", "none"),
        told(
            "friction of the pads",
            "rubber, 1.0, whatever it touches (priority)",
            "0.6 to 0.8, without priority; a shake after lifting",
        ),
    ]
}
