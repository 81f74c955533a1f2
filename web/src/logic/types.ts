// The shapes that the gateway sends, under short names. They are generated: `npm run api` after the API changed.
import type { components } from '../api'

type Schemas = components['schemas']

export type AlarmCounts = Schemas['AlarmCounts']
export type AlarmsEvent = Schemas['AlarmsEvent']
export type AlarmView = Schemas['AlarmView']
export type DeviceView = Schemas['DeviceView']
export type GroupView = Schemas['GroupView']
export type JoinedPointView = Schemas['JoinedPointView']
export type JoinedView = Schemas['JoinedView']
export type LatencyView = Schemas['LatencyView']
export type PlanView = Schemas['PlanView']
export type PlannedRound = Schemas['PlannedRound']
export type PointsView = Schemas['PointsView']
export type PointView = Schemas['PointView']
export type Quality = Schemas['Quality']
export type Rate = Schemas['Rate']
export type SiteInfo = Schemas['SiteInfo']
export interface Snapshot {
  site: SiteInfo
  devices: DeviceView[]
  alarms: AlarmView[]
}
export interface StateEvent {
  device: string
  values: ValueView[]
  joined: JoinedView[]
}
export type UnitView = Schemas['UnitView']
export type ValuesEvent = Schemas['ValuesEvent']
export type ValueView = Schemas['ValueView']
export type WireDetailView = Schemas['WireDetailView']
export type WireTime = Schemas['WireTime']
export type WireView = Schemas['WireView']

/** The classes that an active alarm can have. */
export type AlarmClass = keyof AlarmCounts
