// What a profile says the manual leaves open, in words for people.

const OPEN: Readonly<Record<string, string>> = {
  sign: 'whether it can be negative',
  scale: 'its scale',
  unit: 'its unit',
  format: 'its format',
  offset: 'its offset',
  encoding: 'how it is encoded',
  meaning: 'what it means',
  source: 'where it is measured',
  class: 'how grave it is',
  range: 'its range',
  epoch: 'what time it counts from',
  sentinel: 'which value stands for no data',
  'no-data value': 'which value stands for no data',
  'full scale': 'which number is full scale',
  'byte order': 'the order of its bytes',
  'bit order': 'the order of its bits',
  'field order': 'the order of its fields',
  'pixel order': 'the order of its pixels',
  'sign code': 'which code its sign has',
  'order of the inputs': 'the order of the inputs',
  'meaning of the codes': 'what its codes mean',
  'module number': 'the number of the module',
}

/** Short words that the profiles use become sentences; whatever else they say stands as it is. */
export function doubtText(doubt: string): string {
  return doubt
    .split(/;\s*/)
    .map((part) => {
      const items = part.split(/,\s*/).map((item) => OPEN[item.trim()])
      if (!items.every((item) => item !== undefined)) return `The manual leaves in doubt: ${part.trim()}.`
      const last = items.pop() ?? ''
      return `The manual does not say for certain ${items.length > 0 ? `${items.join(', ')} and ` : ''}${last}.`
    })
    .join(' ')
}
