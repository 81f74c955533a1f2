import { expect, test } from 'vitest'
import { sharedReason, standing, worstStanding } from './quality'
import { stamp, START, value } from './samples'

const at = (seconds: number) => START + seconds * 1000

test('a good value that did not change is as old as the last round', () => {
  expect(standing(value('a', 1), at(30), at(31), true)).toEqual({ look: 'good', age: 1000 })
})

test('a value newer than its round keeps its own time', () => {
  expect(standing(value('a', 1, { ts: stamp(32) }), at(30), at(33), true).age).toBe(1000)
})

test.each(['stale', 'bad'] as const)('rounds that go on do not make a %s value younger', (quality) => {
  expect(standing(value('a', 1, { quality }), at(30), at(31), true)).toEqual({ look: quality, age: 31_000 })
})

test('without a connection a good value is stale, a bad one stays bad', () => {
  expect(standing(value('a', 1), at(30), at(90), false)).toEqual({ look: 'stale', age: 60_000 })
  expect(standing(value('a', 1, { quality: 'bad' }), at(30), at(90), false).look).toBe('bad')
  expect(standing(value('a', null, { quality: 'invalid' }), at(30), at(90), false).look).toBe('invalid')
})

test('what was never read, and what is no value, has no age', () => {
  expect(standing(value('a', null, { quality: 'invalid' }), at(30), at(31), true)).toEqual({
    look: 'invalid',
    age: undefined,
  })
  expect(standing(undefined, at(30), at(31), true)).toEqual({ look: 'unread', age: undefined })
  expect(standing(value('a', null, { quality: 'bad', ts: null }), at(30), at(31), true).age).toBeUndefined()
})

test('a gateway whose clock is ahead gives no negative age', () => {
  expect(standing(value('a', 1, { ts: stamp(5) }), undefined, at(4), true).age).toBe(0)
})

test('a shared line shows the worst quality and the greatest age', () => {
  expect(
    worstStanding([
      { look: 'good', age: 900 },
      { look: 'bad', age: 12_000 },
      { look: 'stale', age: undefined },
    ]),
  ).toEqual({ look: 'bad', age: 12_000 })
})

test('one reason for all is shared, two are not', () => {
  const bad = (error: string) => value('a', null, { quality: 'bad', error })
  expect(sharedReason([value('a', 1), undefined, bad('no answer'), bad('no answer')])).toBe('no answer')
  expect(sharedReason([bad('no answer'), bad('exception 2')])).toBeUndefined()
  expect(sharedReason([value('a', 1)])).toBeUndefined()
})
