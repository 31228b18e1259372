//! Quantities that the simulated robot gets from the simulator, and that would have to be measured for a real one.

/// A quantity given to the simulated robot.
pub(super) struct Given {
    /// The quantity.
    pub what: &'static str,
    /// Its source.
    pub source: &'static str,
    /// The error under which grasps are tested.
    pub error: &'static str,
}

/// All such quantities.
pub(super) fn known_from_simulator() -> [Given; 13] {
    let given = |what, source, error| Given { what, source, error };
    [
        given(
            "box, outline, grasp marks of the demonstration",
            "projected and drawn from the part's own geometry, vertices as a careful person marks them",
            "jittered by 3 px",
        ),
        given("the part's rotational symmetry, at teaching", "its description (object.json)", "none"),
        given("camera intrinsics: focal length, middle, no distortion", "the simulated camera itself", "none"),
        given(
            "height of the camera in the demonstration, 0.58 m",
            "the demonstration was photographed from there, and both looks are from there",
            "none in grasps; the axis of heights in pictures",
        ),
        given("pose of the arm at each picture", "the simulated joints, without encoder errors", "none"),
        given("camera in the hand (hand-eye)", "the model of the arm", "2 mm and 0.5°"),
        given("height of the table", "the simulated table, flat and level at z = 0", "none"),
        given("height of the marks above the table", "the part's description (object.json)", "3 mm"),
        given("height of the grasp above the table", "the part's description (object.json)", "none"),
        given(
            "the area where parts lie",
            "scenes place the part where it is completely visible from the look-out \
               pose",
            "none",
        ),
        given("the face on which the part rests", "the same as in the demonstration", "none"),
        given("dynamics of the arm for its controller", "the simulated arm's own mass matrix", "none"),
        given(
            "friction of the pads",
            "rubber, 1.0, whatever it touches (priority)",
            "0.6 to 0.8, without priority; a shake after lifting",
        ),
    ]
}
