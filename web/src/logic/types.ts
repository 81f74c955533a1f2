// The shapes that the gateway sends, under short names. They are generated: `npm run api` after the API changed.
import type { components } from '../api'

type Schemas = components['schemas']

export type AlarmCounts = Schemas['AlarmCounts']
export type AlarmsEvent = Schemas['AlarmsEvent']
export type AlarmView = Schemas['AlarmView']
export type DeviceView = Schemas['DeviceView']
export type GroupView = Schemas['GroupView']
export type PointsView = Schemas['PointsView']
export type PointView = Schemas['PointView']
export type Quality = Schemas['Quality']
export type Rate = Schemas['Rate']
export type SiteInfo = Schemas['SiteInfo']
export type Snapshot = Schemas['SnapshotEvent']
export type ValuesEvent = Schemas['ValuesEvent']
export type ValueView = Schemas['ValueView']

/** The classes that an active alarm can have. */
export type AlarmClass = keyof AlarmCounts
