// Generated from src/bioscara/api/messages.py by `make generate`: the messages of an owner, as JSON.

export type FromClient = ClientHello | ClientRequest | Received | Leave;

export type AnyCommand = Start | AddPoints | SetJogVelocity | EndJog | Cancel | PauseGoal | ResumeGoal | Pause | Resume | SetSpeedOverride | StopAll | SimulateFault | PushBody | TiltBody | AddObstacle | TakeAway | SetRealTimeFactor | MakePlan | LoadController | ConfigureController | CleanupController | UnloadController | SwitchControllers | SetHardwareState | AddGoalPoints | FollowGoal | StreamTrajectory | SendGripperGoal | TriggerHoming | CommandController | CancelControllerGoal | SetControllerScaling | SetControllerParameters | QueryController | GetIntrospection | AcquireLease | RenewLease | ReleaseLease | GetState | GetDescription | GetWorkspace | GetHistory | GetSimulation | GetBodies | GetWorld | GetImage | GetFaults | GetGoal | GetTrajectories | GetLease | GetStatistics | GetJoints | GetParameters | SetParameters | ListControllers | ListFlightRecords | GetFlightRecord | ListGoals | Report | GetLog | Subscribe | Recall;

export type AnyTask = MoveJoints | MoveTo | MoveLinear | MoveRelative | MoveCircular | MoveNamed | MoveSequence | Unfold | Home | MoveGripper | OpenGripper | CloseGripper | Grasp | Release | EnableGripper | DisableGripper | Enable | Disable | Acknowledge | Recover | SetTool | SetReducedSpeed | Attach | Detach | ConfirmScene | Wait | Follow | Execute | Jog | SetScene | SetTable;

export type Motion = MoveJoints | MoveTo | MoveLinear | MoveRelative | MoveCircular | MoveNamed | MoveSequence | Unfold;

export type FromOwner = Welcome | Response | RequestFailed | StateSample | ControllersSample | WorldSample | Event | GoalCycle;

export type AnyResult = Done | NotArrived | Accepted | PlanMade | LeaseState | Description | WorkspaceState | History | SimulationState | BodyList | ImageFile | FaultList | GoalState | GoalList | PointsAdded | GoalTrajectories | Statistics | JointList | ParametersState | ControllerList | FlightRecordList | FlightRecordFile | LogLines | Switched | HardwareState | ControllerGoal | DesiredState | Introspection | StateSample | WorldSample;

export interface Accepted {
  kind: "accepted";
  goal: GoalValue;
}

export interface Acknowledge {
  kind: "acknowledge";
}

export interface AcquireLease {
  kind: "acquire_lease";
  time_to_live?: number;
  force?: boolean;
}

export interface AddGoalPoints {
  kind: "add_goal_points";
  points: Point[];
  upload?: number;
}

export interface AddObstacle {
  kind: "add_obstacle";
  name: string;
  lower: [number, number, number];
  upper: [number, number, number];
}

export interface AddPoints {
  kind: "add_points";
  points: TrajectoryValue;
  upload?: number;
}

export interface ArmParameters {
  joints: JointParameters[];
  geometry: GeometryParameters;
  gripper: GripperParameters;
  homing_order: string[];
  controllers: ControllerSettings;
}

export interface Attach {
  kind: "attach";
  revision?: number | null;
  load: Load;
}

export type Body = [string, number, Prism[], string[]];

export type BodyBox = [number, number, number, number, number, number];

export interface BodyList {
  kind: "body_list";
  version: number;
  bodies: BodyShape[];
  poses: BodyPose[];
}

export type BodyPose = [string, number, number, number, number, number, number, number];

export type BodyShape = [string, string, boolean, BodyBox[]];

export interface Box {
  name: string;
  lower: [number, number, number];
  upper: [number, number, number];
  yaw?: number;
  keep_in?: boolean;
  links?: string[];
}

export interface BoxZone {
  kind: "box";
  zone: Box;
}

export interface Cancel {
  kind: "cancel";
  goal: number;
}

export interface CancelControllerGoal {
  kind: "cancel_controller_goal";
  controller: string;
  goal: number;
}

export interface CleanupController {
  kind: "cleanup_controller";
  name: string;
}

export interface ClientHello {
  kind: "hello";
  version: number;
  client: string;
  session: string;
}

export interface ClientRequest {
  kind: "request";
  id: number;
  command: Start | AddPoints | SetJogVelocity | EndJog | Cancel | PauseGoal | ResumeGoal | Pause | Resume | SetSpeedOverride | StopAll | SimulateFault | PushBody | TiltBody | AddObstacle | TakeAway | SetRealTimeFactor | MakePlan | LoadController | ConfigureController | CleanupController | UnloadController | SwitchControllers | SetHardwareState | AddGoalPoints | FollowGoal | StreamTrajectory | SendGripperGoal | TriggerHoming | CommandController | CancelControllerGoal | SetControllerScaling | SetControllerParameters | QueryController | GetIntrospection | AcquireLease | RenewLease | ReleaseLease | GetState | GetDescription | GetWorkspace | GetHistory | GetSimulation | GetBodies | GetWorld | GetImage | GetFaults | GetGoal | GetTrajectories | GetLease | GetStatistics | GetJoints | GetParameters | SetParameters | ListControllers | ListFlightRecords | GetFlightRecord | ListGoals | Report | GetLog | Subscribe | Recall;
  epoch?: number | null;
}

export interface CloseGripper {
  kind: "close_gripper";
}

export interface CommandController {
  kind: "command_controller";
  controller: string;
  values: number[];
}

export interface ComponentValue {
  name: string;
  type: string;
  plugin: string;
  state: "unknown" | "unconfigured" | "inactive" | "active" | "finalized";
  rate: number;
  commands: InterfaceValue[];
  states: InterfaceValue[];
}

export interface ConfigureController {
  kind: "configure_controller";
  name: string;
}

export interface ConfirmScene {
  kind: "confirm_scene";
  revision?: number | null;
}

export interface ControllerGoal {
  kind: "controller_goal";
  goal: number;
}

export interface ControllerList {
  kind: "controller_list";
  controllers: ControllerValue[];
  components: ComponentValue[];
  types: string[];
}

export interface ControllerSettings {
  update_rate: UpdateRates;
  joint_trajectory_controller: TrajectorySettings;
  homing_controller: HomingSettings;
  hold_controller: HoldSettings;
  gripper_controller: GripperSettings;
}

export interface ControllerValue {
  name: string;
  type: string;
  state: "unknown" | "unconfigured" | "inactive" | "active" | "finalized";
  update_rate: number;
  claimed: string[];
  commands: string[];
  states: string[];
}

export interface ControllersSample {
  kind: "controllers_sample";
  cycle: number;
  time: number;
  wall: number;
  state_names: string[];
  states: number[];
  command_names: string[];
  commands: number[];
  active: string[];
  controllers: (TrajectoryStatus | GripperStatus)[];
  ended: EndedGoal[];
  activity: number;
}

export type CycleRecord = [Phase, number, number, number, number, number, JointRecord[], number];

export interface Cylinder {
  name: string;
  x: number;
  y: number;
  radius: number;
  low: number;
  high: number;
  keep_in?: boolean;
  links?: string[];
}

export interface CylinderZone {
  kind: "cylinder";
  zone: Cylinder;
}

export interface Description {
  kind: "description";
  name: string;
  arm: string;
  simulated: boolean;
  parameters: ArmParameters;
  rate: number;
  bus_share: number;
  firmware: string[];
  software: string;
}

export interface DesiredState {
  kind: "desired_state";
  names: string[];
  state: Sample;
}

export interface Detach {
  kind: "detach";
  revision?: number | null;
}

export interface DiagnosticValue {
  name: string;
  level: number;
  message: string;
  values: Record<string, string>;
}

export interface Disable {
  kind: "disable";
}

export interface DisableGripper {
  kind: "disable_gripper";
}

export interface Done {
  kind: "done";
}

export interface Enable {
  kind: "enable";
}

export interface EnableGripper {
  kind: "enable_gripper";
}

export interface EndJog {
  kind: "end_jog";
  goal: number;
}

export interface EndedGoal {
  goal: number;
  controller: string;
  status: GoalStatus;
  error_code: number;
  text: string;
  gripper: GripperValue | null;
}

export interface Event {
  kind: "event";
  number: number;
  time: number;
  wall: number;
  what: "acknowledged" | "client" | "controllers" | "fault" | "faults_cleared" | "gap" | "gateway" | "goal_accepted" | "goal_ended" | "lease" | "owner" | "parameters" | "pause" | "report" | "resume" | "simulation" | "speed_override" | "stop" | "unconfirmed" | "warning" | "workspace";
  text: string;
  client: string;
  goal: GoalValue | null;
  fault: FaultValue | null;
  lease: LeaseValue | null;
}

export interface Execute {
  kind: "execute";
  plan: number;
}

export interface FailureValue {
  error: string;
  code: number;
  text: string;
  data: any;
}

export interface FaultList {
  kind: "fault_list";
  state: FaultState;
  faults: FaultValue[];
  warnings: string[];
  warned: number[];
}

export type FaultState = "acknowledged" | "clear" | "latched" | "stopping";

export interface FaultValue {
  fault: "JOINT_LOST" | "BUS_STUCK" | "BUS_FAILED" | "JOINT_RESET" | "STALL" | "FOLLOWING_ERROR" | "SETPOINT_LOST" | "HOMING_FAILED" | "JOINT_FAULT" | "OVERTEMPERATURE" | "POWER_LOST" | "OVERRUN" | "LATE" | "CONTROLLER_FAILED" | "LOOP_FAILED" | "HARDWARE_FAILED";
  source: string;
  text: string;
  cause: FailureValue;
  time: number;
  evidence: string | null;
}

export interface FlightRecordFile {
  kind: "flight_record_file";
  name: string;
  data: string;
}

export interface FlightRecordList {
  kind: "flight_record_list";
  names: string[];
}

export interface Follow {
  kind: "follow";
  trajectory: TrajectoryValue;
  approach?: boolean;
  planned?: boolean;
  upload?: number;
}

export interface FollowGoal {
  kind: "follow_goal";
  controller: string;
  goal: Goal;
  upload?: number;
}

export interface Frame {
  name: string;
  pose_frame_in_base: Pose;
}

export interface GeometryParameters {
  height: number;
  upper_arm: number;
  forearm: number;
  tool_x: number;
  tool_y: number;
  tool_z: number;
  tool_mass: number;
}

export interface GetBodies {
  kind: "get_bodies";
}

export interface GetDescription {
  kind: "get_description";
}

export interface GetFaults {
  kind: "get_faults";
}

export interface GetFlightRecord {
  kind: "get_flight_record";
  name: string;
}

export interface GetGoal {
  kind: "get_goal";
  goal: number;
}

export interface GetHistory {
  kind: "get_history";
  begin: number;
  end?: number | null;
  points?: number;
}

export interface GetImage {
  kind: "get_image";
  camera?: string;
  width?: number;
  height?: number;
}

export interface GetIntrospection {
  kind: "get_introspection";
  thresholds?: Record<string, number>;
}

export interface GetJoints {
  kind: "get_joints";
}

export interface GetLease {
  kind: "get_lease";
}

export interface GetLog {
  kind: "get_log";
  after?: number;
}

export interface GetParameters {
  kind: "get_parameters";
}

export interface GetSimulation {
  kind: "get_simulation";
}

export interface GetState {
  kind: "get_state";
}

export interface GetStatistics {
  kind: "get_statistics";
}

export interface GetTrajectories {
  kind: "get_trajectories";
  goal: number;
  first?: number;
}

export interface GetWorkspace {
  kind: "get_workspace";
}

export interface GetWorld {
  kind: "get_world";
}

export interface Goal {
  trajectory: JointTrajectory;
  path_tolerance?: Tolerance[];
  goal_tolerance?: Tolerance[];
  goal_time_tolerance?: number;
  collision_checked?: boolean;
}

export interface GoalCycle {
  kind: "cycle";
  goal: number;
  record: CycleRecord;
}

export interface GoalList {
  kind: "goal_list";
  goals: GoalValue[];
}

export interface GoalState {
  kind: "goal_state";
  goal: GoalValue;
}

export type GoalStatus = "aborted" | "accepted" | "canceled" | "executing" | "succeeded";

export interface GoalTrajectories {
  kind: "goal_trajectories";
  goal: number;
  trajectories: TrajectoryValue[];
  points: number;
}

export interface GoalValue {
  goal: number;
  name: string;
  client: string;
  status: Status;
  progress: number;
  failure: FailureValue | null;
  gripper: GripperValue | null;
  duration: number;
  notes: string[];
  limitation: JogLimitation | null;
}

export interface Grasp {
  kind: "grasp";
  load: Load;
  width?: number | null;
  squeeze?: number;
}

export interface GripperGoal {
  position: number[];
  velocity?: number[];
  effort?: number[];
}

export interface GripperParameters {
  lower: number;
  upper: number;
  max_velocity: number;
  initial: number;
  deg_per_m: number;
  zero_width: number;
  frequency: number;
  pulse_center: number;
  pulse_per_deg: number;
  pulse_lower: number;
  pulse_upper: number;
  outputs: PwmOutput[];
}

export interface GripperSettings {
  goal_tolerance: number;
  allow_stalling: boolean;
  stall_velocity_threshold: number;
  stall_timeout: number;
}

export interface GripperStatus {
  kind: "gripper";
  name: string;
  joint: string;
  goal: number | null;
  position: number;
  velocity: number;
  effort: number;
  reached: boolean;
  stalled: boolean;
}

export interface GripperValue {
  position: number;
  velocity: number;
  reached_goal: boolean;
  stalled: boolean;
  quality: number;
}

export interface HardwareState {
  kind: "hardware_state";
  component: string;
  state: "unknown" | "unconfigured" | "inactive" | "active" | "finalized";
}

export interface History {
  kind: "history";
  oldest: number;
  time: number[];
  names: string[];
  positions: number[][];
  velocities: number[][];
  commands: number[][];
  errors: number[][];
  loads: number[][] | null;
  late: number[];
  bus_time: number[];
}

export interface HoldSettings {
  max_deceleration_share: number;
}

export interface Home {
  kind: "home";
  joints?: string[] | null;
  sensitivity?: number | Record<string, number> | null;
  current?: number | Record<string, number> | null;
}

export interface HomingParameters {
  velocity: number;
  threshold: number;
  current_percent: number;
  acceleration: number;
}

export interface HomingSettings {
  timeout: number;
  max_travel_share: number;
}

export interface ImageFile {
  kind: "image_file";
  time: number;
  camera: string;
  data: string;
}

export interface InterfaceValue {
  name: string;
  available: boolean;
  claimed: boolean;
}

export interface Introspection {
  kind: "introspection";
  values: Record<string, number>;
  diagnostics: DiagnosticValue[];
}

export interface Jog {
  kind: "jog";
  expiry?: number | null;
  joints?: JointVelocity | null;
  tool?: ToolVelocity | null;
}

export type JogLimit = "change" | "expired" | "folded" | "joint_limit" | "joint_speed" | "self" | "stretched" | "table" | "tool_speed" | "zone";

export interface JogLimitation {
  limit: JogLimit;
  held: boolean;
  name: string;
  value: number;
  unit: string;
  text: string;
}

export interface JointCounters {
  fault: string;
  data: number;
  refusal: string;
  broken: number;
  refused: number;
  bus_errors: number | null;
}

export interface JointList {
  kind: "joint_list";
  joints: JointValue[];
  counted: number;
}

export interface JointParameters {
  name: string;
  address: number;
  unit: string;
  reduction: number;
  lower: number;
  upper: number;
  max_velocity: number;
  max_acceleration: number;
  drive_current_percent: number;
  hold_current_percent: number;
  stall_threshold: number;
  homing: HomingParameters;
  belt_period: number;
}

export type JointRecord = [number, number, number, number, number, number, SampleQuality, number];

export interface JointTolerances {
  trajectory: number;
  goal: number;
}

export interface JointTrajectory {
  joint_names: string[];
  points: Point[];
  stamp?: number;
}

export interface JointValue {
  name: string;
  address: number;
  protocol: number;
  firmware: string;
  boot_id: number | null;
  reset_cause: string;
  capabilities: string[];
  mode: string;
  halted: string;
  hot: boolean | null;
  retries: number;
  counters: JointCounters | null;
}

export type JointVelocity = [number, number, number, number];

export type Joints = [number, number, number, number];

export interface LeaseState {
  kind: "lease_state";
  lease: LeaseValue;
}

export interface LeaseValue {
  client: string | null;
  epoch: number;
  remaining: number;
}

export interface Leave {
  kind: "leave";
  may_return?: boolean;
}

export interface ListControllers {
  kind: "list_controllers";
}

export interface ListFlightRecords {
  kind: "list_flight_records";
}

export interface ListGoals {
  kind: "list_goals";
}

export interface Load {
  name: string;
  shape: Prism;
  mass?: number;
  touches?: string[];
  max_speed?: number | null;
}

export interface LoadController {
  kind: "load_controller";
  name: string;
  type: string;
  parameters?: any;
}

export interface LogLines {
  kind: "log_lines";
  last: number;
  lines: string[];
}

export interface MakePlan {
  kind: "make_plan";
  motion: MoveJoints | MoveTo | MoveLinear | MoveRelative | MoveCircular | MoveNamed | MoveSequence | Unfold;
}

export type Motion = "circ" | "lin" | "ptp";

export interface MoveCircular {
  kind: "move_circular";
  velocity_scaling?: number;
  acceleration_scaling?: number;
  via: Pose | string;
  pose: Pose | string;
  frame?: string | null;
}

export interface MoveGripper {
  kind: "move_gripper";
  width: number;
}

export interface MoveJoints {
  kind: "move_joints";
  velocity_scaling?: number;
  acceleration_scaling?: number;
  positions: number[];
}

export interface MoveLinear {
  kind: "move_linear";
  velocity_scaling?: number;
  acceleration_scaling?: number;
  pose: Pose | string;
  frame?: string | null;
}

export interface MoveNamed {
  kind: "move_named";
  velocity_scaling?: number;
  acceleration_scaling?: number;
  name: string;
}

export interface MoveRelative {
  kind: "move_relative";
  velocity_scaling?: number;
  acceleration_scaling?: number;
  x?: number;
  y?: number;
  z?: number;
  yaw?: number;
}

export interface MoveSequence {
  kind: "move_sequence";
  velocity_scaling?: number;
  acceleration_scaling?: number;
  waypoints: Waypoint[];
}

export interface MoveTo {
  kind: "move_to";
  velocity_scaling?: number;
  acceleration_scaling?: number;
  pose: Pose | string;
  frame?: string | null;
}

export interface NamedPose {
  name: string;
  joints?: Joints | null;
  pose_tool_in_base?: Pose | null;
  tool?: string;
  calibration?: string;
}

export interface NotArrived {
  kind: "not_arrived";
}

export interface OpenGripper {
  kind: "open_gripper";
}

export interface ParametersState {
  kind: "parameters_state";
  revision: number;
  overlay: string;
  restart: boolean;
}

export interface Pause {
  kind: "pause";
  may_resume?: boolean;
}

export interface PauseGoal {
  kind: "pause_goal";
  goal: number;
}

export type Phase = "approach" | "controllers" | "homing" | "jog" | "settling" | "stopping" | "trajectory" | "watching";

export interface PlanMade {
  kind: "plan_made";
  plan: number;
  trajectory: TrajectoryValue;
  notes: string[];
  points: number;
}

export type Point = [number, number[], number[], number[], number[]];

export interface PointsAdded {
  kind: "points_added";
  upload: number;
  count: number;
}

export type Pose = [number, number, number, number];

export interface Prism {
  x: number;
  y: number;
  half_x: number;
  half_y: number;
  low: number;
  high: number;
  radius?: number;
  yaw?: number;
}

export interface PushBody {
  kind: "push_body";
  name: string;
  force: [number, number, number];
  duration?: number;
}

export interface PwmOutput {
  device: string;
  channel: number;
}

export interface QueryController {
  kind: "query_controller";
  controller: string;
  time: number;
}

export interface Recall {
  kind: "recall";
  request: number;
}

export interface Received {
  kind: "received";
  cycle: number;
}

export interface Recover {
  kind: "recover";
}

export interface Release {
  kind: "release";
  opening?: number;
}

export interface ReleaseLease {
  kind: "release_lease";
}

export interface RenewLease {
  kind: "renew_lease";
}

export interface Report {
  kind: "report";
  text: string;
}

export interface RequestFailed {
  kind: "refusal";
  id: number | null;
  failure: FailureValue;
}

export interface Response {
  kind: "response";
  id: number;
  result: Done | NotArrived | Accepted | PlanMade | LeaseState | Description | WorkspaceState | History | SimulationState | BodyList | ImageFile | FaultList | GoalState | GoalList | PointsAdded | GoalTrajectories | Statistics | JointList | ParametersState | ControllerList | FlightRecordList | FlightRecordFile | LogLines | Switched | HardwareState | ControllerGoal | DesiredState | Introspection | StateSample | WorldSample;
}

export interface Resume {
  kind: "resume";
}

export interface ResumeGoal {
  kind: "resume_goal";
  goal: number;
}

export type Sample = [number[], number[], number[]];

export type SampleQuality = 0 | 1 | 2;

export interface SceneValue {
  zones?: (BoxZone | CylinderZone)[];
  table_height?: number | null;
  margin?: number;
  mounted?: Body[] | null;
}

export interface SendGripperGoal {
  kind: "send_gripper_goal";
  controller: string;
  goal: GripperGoal;
}

export interface SetControllerParameters {
  kind: "set_controller_parameters";
  controller: string;
  parameters: any;
}

export interface SetControllerScaling {
  kind: "set_controller_scaling";
  controller: string;
  factor: number;
}

export interface SetHardwareState {
  kind: "set_hardware_state";
  component: string;
  state: "unknown" | "unconfigured" | "inactive" | "active" | "finalized";
}

export interface SetJogVelocity {
  kind: "set_jog_velocity";
  goal: number;
  joints?: JointVelocity | null;
  tool?: ToolVelocity | null;
}

export interface SetParameters {
  kind: "set_parameters";
  overlay: string;
  revision: number;
}

export interface SetRealTimeFactor {
  kind: "set_real_time_factor";
  real_time_factor: number;
}

export interface SetReducedSpeed {
  kind: "set_reduced_speed";
  revision?: number | null;
  reduced: boolean;
}

export interface SetScene {
  kind: "set_scene";
  revision?: number | null;
  scene: SceneValue;
}

export interface SetSpeedOverride {
  kind: "set_speed_override";
  share: number;
}

export interface SetTable {
  kind: "set_table";
  revision?: number | null;
  table: TeachTable;
  save?: boolean;
}

export interface SetTool {
  kind: "set_tool";
  revision?: number | null;
  name: string;
}

export interface SimulateFault {
  kind: "simulate_fault";
  fault: "reset" | "power" | "hang" | "overheat" | "freeze_encoder" | "obstacle" | "clear_obstacles" | "push" | "supply" | "brown_out" | "bus_flips" | "bus_loss" | "bus_stuck" | "clear";
  joint?: string;
  value?: number | null;
}

export interface SimulatedFaultValue {
  fault: "reset" | "power" | "hang" | "overheat" | "freeze_encoder" | "obstacle" | "clear_obstacles" | "push" | "supply" | "brown_out" | "bus_flips" | "bus_loss" | "bus_stuck" | "clear";
  joint: string;
  value: number;
  since: number;
}

export interface SimulationState {
  kind: "simulation";
  available: boolean;
  real_time_factor: number;
  faults: SimulatedFaultValue[];
}

export interface Start {
  kind: "start";
  task: MoveJoints | MoveTo | MoveLinear | MoveRelative | MoveCircular | MoveNamed | MoveSequence | Unfold | Home | MoveGripper | OpenGripper | CloseGripper | Grasp | Release | EnableGripper | DisableGripper | Enable | Disable | Acknowledge | Recover | SetTool | SetReducedSpeed | Attach | Detach | ConfirmScene | Wait | Follow | Execute | Jog | SetScene | SetTable;
  timeout?: number | null;
  on_lease_loss?: "finish" | "stop";
  records?: boolean;
}

export interface StateSample {
  kind: "state";
  cycle: number;
  time: number;
  names: string[];
  positions: number[];
  velocities: number[];
  qualities: number[];
  stamps: number[];
  flags: number[];
  commands: number[];
  pose: Pose | null;
  width: number;
  enabled: boolean;
  fault: FaultState;
  paused: boolean;
  speed_override: number;
  moving: string[];
  late: number;
  bus_time: number;
  stale: boolean;
  loads: number[] | null;
  limitation: JogLimitation | null;
  paused_by: string[];
}

export interface Statistics {
  kind: "statistics";
  cycles: number;
  overruns: number;
  rate: number;
  late: [number, number, number];
  read: [number, number, number];
  update: [number, number, number];
  write: [number, number, number];
  clients: number;
  memory: number;
  uptime: number;
}

export type Status = "cancelled" | "failed" | "paused" | "running" | "stopping" | "succeeded" | "waiting";

export interface StopAll {
  kind: "stop";
}

export interface StreamTrajectory {
  kind: "stream_trajectory";
  controller: string;
  trajectory: JointTrajectory;
  upload?: number;
}

export interface Subscribe {
  kind: "subscribe";
  states?: boolean;
  period?: number;
  unconfirmed?: number;
  events_after?: number | null;
  controllers?: boolean;
  controllers_period?: number;
  world?: boolean;
  world_period?: number;
}

export interface SwitchControllers {
  kind: "switch_controllers";
  activate?: string[];
  deactivate?: string[];
  strict?: boolean;
}

export interface Switched {
  kind: "switched";
  text: string;
}

export interface TakeAway {
  kind: "take_away";
  name: string;
}

export interface TeachTable {
  fingers: Tool;
  tools?: Tool[];
  poses?: NamedPose[];
  frames?: Frame[];
}

export interface TiltBody {
  kind: "tilt_body";
  name: string;
  height: number;
  direction?: number;
}

export type Tolerance = [string, number, number, number];

export interface Tool {
  name: string;
  pose_tool_in_flange: Pose;
  mass?: number;
}

export type ToolVelocity = [number, number, number, number];

export interface TrajectoryConstraints {
  stopped_velocity_tolerance: number;
  goal_time: number;
  max_deceleration_on_cancel_share: number;
  j1: JointTolerances;
  j2: JointTolerances;
  j3: JointTolerances;
  j4: JointTolerances;
}

export interface TrajectorySettings {
  allow_partial_joints_goal: boolean;
  allow_nonzero_velocity_at_trajectory_end: boolean;
  constraints: TrajectoryConstraints;
}

export interface TrajectoryStatus {
  kind: "trajectory";
  name: string;
  time: number;
  joints: string[];
  trajectory_time: number;
  reference: Sample;
  feedback: Sample;
  error: Sample;
  output: Record<string, number>;
  scaling: number;
  point: number;
  goal: number | null;
}

export interface TrajectoryValue {
  joint_names: string[];
  times: number[];
  positions: number[][];
  velocities?: number[][] | null;
  accelerations?: number[][] | null;
}

export interface TriggerHoming {
  kind: "trigger_homing";
  controller: string;
  joint: string;
  command: number;
}

export interface Unfold {
  kind: "unfold";
  velocity_scaling?: number;
  acceleration_scaling?: number;
}

export interface UnloadController {
  kind: "unload_controller";
  name: string;
}

export interface UpdateRates {
  version_1: number;
  version_2: number;
}

export interface Wait {
  kind: "wait";
  seconds: number;
}

export interface Waypoint {
  pose: Pose;
  motion?: Motion;
  blend?: number;
  via?: Pose | null;
  velocity_scaling?: number;
}

export interface Welcome {
  kind: "welcome";
  version: number;
  owner: string;
  instance: string;
  arm: string;
  last_event: number;
  resumed: boolean;
}

export interface WorkspaceState {
  kind: "workspace_state";
  revision: number;
  scene: SceneValue;
  table: TeachTable;
  tool: Tool;
  reduced_speed: boolean;
  load: Load | null;
  widths: [number, number];
  unconfirmed: string[];
}

export interface WorldSample {
  kind: "world";
  cycle: number;
  time: number;
  version: number;
  held: string | null;
  width: number;
  poses: BodyPose[];
}
