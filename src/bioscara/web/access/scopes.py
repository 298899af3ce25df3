"""The rights of a credential: to look, operate, or administer."""

from __future__ import annotations

from enum import IntEnum

from bioscara.api import messages as m


class Scope(IntEnum):
    """Rights of a credential; each includes the ones before it."""

    VIEW = 1
    """Look, plan, stop and pause."""
    OPERATE = 2
    """Take the lease and command the arm."""
    ADMIN = 3
    """Take the lease from another client; change parameters, controllers and hardware."""


_VIEW = frozenset(
    {
        m.Subscribe,
        m.Recall,
        m.GetState,
        m.GetDescription,
        m.GetWorkspace,
        m.GetHistory,
        m.GetSimulation,
        m.GetFaults,
        m.GetGoal,
        m.GetTrajectories,
        m.GetLease,
        m.GetStatistics,
        m.GetJoints,
        m.GetParameters,
        m.ListControllers,
        m.ListFlightRecords,
        m.GetFlightRecord,
        m.ListGoals,
        m.GetLog,
        m.MakePlan,
        m.QueryController,
        m.GetIntrospection,
        m.StopAll,
        m.Pause,
    }
)
_OPERATE = frozenset(
    {
        m.Start,
        m.AddPoints,
        m.SetJogVelocity,
        m.EndJog,
        m.Cancel,
        m.PauseGoal,
        m.ResumeGoal,
        m.Resume,
        m.SetSpeedOverride,
        # The owner refuses these on a real arm, and on a simulated one they harm nothing.
        m.SimulateFault,
        m.SetSimulationSpeed,
        m.AcquireLease,
        m.RenewLease,
        m.ReleaseLease,
        m.Report,
    }
)
_OPERATE_TASKS = frozenset(
    {
        m.MoveJoints,
        m.MoveTo,
        m.MoveLinear,
        m.MoveRelative,
        m.MoveCircular,
        m.MoveNamed,
        m.MoveSequence,
        m.Unfold,
        m.HomeTask,
        m.Follow,
        m.Execute,
        m.JogTask,
        m.MoveGripperTask,
        m.OpenGripperTask,
        m.CloseGripperTask,
        m.GraspTask,
        m.ReleaseLoad,
        m.EnableTask,
        m.DisableTask,
        m.EnableGripperTask,
        m.DisableGripperTask,
        m.AcknowledgeTask,
        m.RecoverTask,
        m.SetScene,
        m.SetTable,
        m.SetTool,
        m.SetReducedSpeed,
        m.AttachTask,
        m.DetachTask,
        m.ConfirmScene,
    }
)


def required_scope(command: m.AnyCommand) -> Scope:
    """Return the scope that a command needs; a command that is not listed here needs ADMIN."""
    if type(command) in _VIEW:
        return Scope.VIEW
    if type(command) not in _OPERATE:
        return Scope.ADMIN
    match command:
        case m.AcquireLease(force=True):
            return Scope.ADMIN
        case m.Start(task=task) if type(task) not in _OPERATE_TASKS:
            return Scope.ADMIN
    return Scope.OPERATE
