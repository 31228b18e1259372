//! The rules of `action_msgs/srv/CancelGoal` for a server with one goal at a time.

use ros2_client::action::GoalId;
use ros2_client::action_msgs::{CancelGoalRequest, CancelGoalResponse, CancelGoalResponseEnum, GoalInfo};
use ros2_client::builtin_interfaces::Time;
use ros2_client::dds::rustdds::serialization::{deserialize_from_cdr_with_rep_id, to_writer_with_rep_id};
use ros2_client::dds::rustdds::{RepresentationIdentifier, serialization};

/// The id and the stamp of a request. `ros2-client` keeps the request's only field, which contains both, private, but
/// the request has the same bytes.
///
/// # Errors
/// Errors of the serialization, which a received request does not cause.
pub(super) fn named_in(request: &CancelGoalRequest) -> serialization::Result<GoalInfo> {
    let mut bytes = Vec::new();
    to_writer_with_rep_id(&mut bytes, request, RepresentationIdentifier::CDR_LE)?;
    Ok(deserialize_from_cdr_with_rep_id(&bytes, RepresentationIdentifier::CDR_LE)?.0)
}

/// The answer to a request with an id and a stamp, each 0 if not given. An id names one goal, and a stamp the goals
/// accepted at or before it; if neither is given, all goals are named. `running` is cancelled if it is named.
pub(super) fn answer(named: &GoalInfo, running: Option<&GoalInfo>, ended: &[GoalId]) -> CancelGoalResponse {
    let has_stamp = named.stamp != Time::ZERO;
    let has_id = named.goal_id != GoalId::ZERO;
    let is_named = |goal: &&GoalInfo| {
        goal.goal_id == named.goal_id || (has_stamp && goal.stamp <= named.stamp) || !(has_id || has_stamp)
    };
    let goals_canceling: Vec<GoalInfo> = running.filter(is_named).into_iter().cloned().collect();
    let return_code = match (goals_canceling.is_empty(), has_id) {
        (false, _) => CancelGoalResponseEnum::None,
        (true, false) => CancelGoalResponseEnum::Rejected,
        (true, true) if ended.contains(&named.goal_id) => CancelGoalResponseEnum::GoalTerminated,
        (true, true) => CancelGoalResponseEnum::UnknownGoal,
    };
    CancelGoalResponse { return_code, goals_canceling }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(goal_id: GoalId, stamp: i64) -> GoalInfo {
        GoalInfo { goal_id, stamp: Time::from_nanos(stamp) }
    }

    #[test]
    fn only_a_named_goal_is_cancelled() {
        let [running, ended, unknown] = [0; 3].map(|_| GoalId::new_random());
        let accepted = info(running, 1000);
        for (id, stamp, expected) in [
            (GoalId::ZERO, 0, CancelGoalResponseEnum::None),
            (GoalId::ZERO, 999, CancelGoalResponseEnum::Rejected),
            (GoalId::ZERO, 1000, CancelGoalResponseEnum::None),
            (running, 0, CancelGoalResponseEnum::None),
            (running, 999, CancelGoalResponseEnum::None),
            (ended, 0, CancelGoalResponseEnum::GoalTerminated),
            (ended, 999, CancelGoalResponseEnum::GoalTerminated),
            (ended, 1000, CancelGoalResponseEnum::None),
            (unknown, 0, CancelGoalResponseEnum::UnknownGoal),
        ] {
            let found = answer(&info(id, stamp), Some(&accepted), &[ended]);
            assert_eq!(found.return_code, expected, "{id:?} {stamp}");
            let canceling: Vec<_> = found.goals_canceling.iter().map(|goal| (goal.goal_id, goal.stamp)).collect();
            let is_cancelled = expected == CancelGoalResponseEnum::None;
            assert_eq!(canceling, if is_cancelled { vec![(running, accepted.stamp)] } else { vec![] });
        }
    }

    #[test]
    fn without_a_running_goal_none_is_cancelled() {
        let ended = GoalId::new_random();
        for (id, expected) in
            [(GoalId::ZERO, CancelGoalResponseEnum::Rejected), (ended, CancelGoalResponseEnum::GoalTerminated)]
        {
            let found = answer(&info(id, 0), None, &[ended]);
            assert!(found.return_code == expected && found.goals_canceling.is_empty(), "{found:?}");
        }
    }

    /// The bytes of a request: the id, seconds and nanoseconds.
    #[test]
    fn a_request_names_id_and_stamp() {
        let bytes: Vec<u8> = (1..=16).chain([7, 0, 0, 0, 9, 0, 0, 0]).collect();
        let (request, _) = deserialize_from_cdr_with_rep_id(&bytes, RepresentationIdentifier::CDR_LE).unwrap();
        let named = named_in(&request).unwrap();
        assert_eq!(named.goal_id.uuid.as_bytes().as_slice(), &bytes[..16]);
        assert_eq!(named.stamp, Time::from_nanos(7_000_000_009));
    }
}
